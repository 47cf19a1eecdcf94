import { type PointerEvent, useEffect, useRef, useState } from "react";
import { movedView, type View } from "./camera";
import type { Scheme } from "./colours";
import { Drawing } from "./drawing";
import { follow } from "./follow";
import type { AnglesSource } from "./ghost";
import type { Limits, Motor } from "./limits";
import type { Side } from "./vectors";

interface SceneProps {
  side: Side;
  limits: Limits;
  view: View;
  scheme: Scheme;
  only: Motor | null;
  real: AnglesSource | null;
  ghost: AnglesSource | null;
  label: string;
  onView: (view: View) => void;
  onUnable: () => void;
}

const DEG_PER_PIXEL = 0.4;

/** The canvas. Angles go from their source to the drawing worker ten times a second, without React. */
export function Scene(props: SceneProps) {
  const { view, label, onView } = props;
  const { place, late } = useDrawing(props);
  const onDrag = (event: PointerEvent<HTMLDivElement>) => {
    if (event.buttons !== 1) return;
    onView(movedView(view, -event.movementX * DEG_PER_PIXEL, event.movementY * DEG_PER_PIXEL));
  };
  return (
    <div
      ref={place}
      role="img"
      aria-label={label}
      data-testid="apparatus-canvas"
      className={late ? "stale" : ""}
      onPointerDown={(event) => event.currentTarget.setPointerCapture(event.pointerId)}
      onPointerMove={onDrag}
      style={{ width: "100%", height: "100%", touchAction: "pan-y", cursor: "grab" }}
    />
  );
}

/** Draw into an element with a worker. Return the element's ref, and whether the picture is late. */
function useDrawing({ side, limits, view, scheme, only, real, ghost, onUnable }: SceneProps) {
  const place = useRef<HTMLDivElement>(null);
  const drawing = useRef<Drawing | null>(null);
  const [late, setLate] = useState(false);
  // Compared by value: the same limits arrive again with each reconnection, and another worker starts without a picture.
  const ranges = JSON.stringify(limits);
  const latest = useRef({ view, scheme, only, onUnable });
  latest.current = { view, scheme, only, onUnable };

  useEffect(() => {
    const element = place.current;
    if (!element) return;
    // Each worker gets its own canvas, because a transferred canvas cannot be taken back.
    const canvas = document.createElement("canvas");
    // The picture keeps its proportions until the worker draws it in a new size.
    canvas.style.cssText = "width: 100%; height: 100%; display: block; object-fit: contain";
    const seen = latest.current;
    let made: Drawing;
    try {
      made = new Drawing(
        new Worker(new URL("./scene/worker.ts", import.meta.url), { type: "module" }),
        {
          canvas: canvas.transferControlToOffscreen(),
          side,
          limits: JSON.parse(ranges) as Limits,
          density: window.devicePixelRatio,
        },
        {
          ...sizeOf(element),
          view: seen.view,
          scheme: seen.scheme,
          only: seen.only,
          real: null,
          ghost: null,
        },
        {
          onLate: setLate,
          onUnable: () => latest.current.onUnable(),
          onDrawn: () => canvas.setAttribute("data-drawn", ""),
        },
      );
    } catch {
      // This browser has no offscreen canvas.
      latest.current.onUnable();
      return;
    }
    drawing.current = made;
    element.append(canvas);
    const fit = new ResizeObserver(() => made.change(sizeOf(element)));
    fit.observe(element);
    return () => {
      fit.disconnect();
      made.close();
      canvas.remove();
      drawing.current = null;
      setLate(false);
    };
  }, [side, ranges]);

  useEffect(() => drawing.current?.change({ view }), [view]);
  useEffect(() => drawing.current?.change({ scheme }), [scheme]);
  useEffect(() => drawing.current?.change({ only }), [only]);
  // A drawing for another side needs the current angles, so side and ranges are dependencies.
  // biome-ignore lint/correctness/useExhaustiveDependencies: see above
  useEffect(() => follow(real, (angles) => drawing.current?.change({ real: angles })), [real, side, ranges]);
  // biome-ignore lint/correctness/useExhaustiveDependencies: see above
  useEffect(
    () => follow(ghost, (angles) => drawing.current?.change({ ghost: angles })),
    [ghost, side, ranges],
  );

  return { place, late };
}

function sizeOf(element: HTMLElement) {
  return { width: element.clientWidth, height: element.clientHeight };
}
