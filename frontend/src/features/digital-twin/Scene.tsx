import { type PointerEvent, useEffect, useRef, useState } from "react";
import { Drawing } from "./drawing";
import type { AnglesSource } from "./ghost";
import type { Limits, Motor } from "./limits";
import type { Side } from "./vectors";
import { moved, type View } from "./view";

interface SceneProps {
  side: Side;
  limits: Limits;
  view: View;
  only: Motor | null;
  real: AnglesSource | null;
  ghost: AnglesSource | null;
  label: string;
  onView: (view: View) => void;
  onUnable: () => void;
}

const DEG_A_PIXEL = 0.4;

/** The canvas. Angles go from their source to the worker that draws, ten times a second, without React. */
export function Scene(props: SceneProps) {
  const { side, limits, view, only, real, ghost, label, onView, onUnable } = props;
  const place = useRef<HTMLDivElement>(null);
  const drawing = useRef<Drawing | null>(null);
  const [behind, setBehind] = useState(false);
  const latest = useRef({ view, only, onUnable });
  latest.current = { view, only, onUnable };

  useEffect(() => {
    const element = place.current;
    if (!element) return;
    // A canvas of its own for each worker: one that has been handed over cannot be had back.
    const canvas = document.createElement("canvas");
    canvas.style.cssText = "width: 100%; height: 100%; display: block";
    const seen = latest.current;
    let made: Drawing;
    try {
      made = new Drawing(
        new Worker(new URL("./scene/worker.ts", import.meta.url), { type: "module" }),
        { canvas: canvas.transferControlToOffscreen(), side, limits, density: window.devicePixelRatio },
        { ...sizeOf(element), view: seen.view, only: seen.only, real: null, ghost: null },
        { onBehind: setBehind, onUnable: () => latest.current.onUnable() },
      );
    } catch {
      // A browser from before such canvases.
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
      setBehind(false);
    };
  }, [side, limits]);

  useEffect(() => drawing.current?.change({ view }), [view]);
  useEffect(() => drawing.current?.change({ only }), [only]);
  // A new drawing, of another side, is shown the same; so side and limits belong to what these follow.
  // biome-ignore lint/correctness/useExhaustiveDependencies: see above
  useEffect(() => follow(real, (angles) => drawing.current?.change({ real: angles })), [real, side, limits]);
  // biome-ignore lint/correctness/useExhaustiveDependencies: see above
  useEffect(
    () => follow(ghost, (angles) => drawing.current?.change({ ghost: angles })),
    [ghost, side, limits],
  );

  const onDrag = (event: PointerEvent<HTMLDivElement>) => {
    if (event.buttons !== 1) return;
    onView(moved(view, -event.movementX * DEG_A_PIXEL, event.movementY * DEG_A_PIXEL));
  };
  return (
    <div
      ref={place}
      role="img"
      aria-label={label}
      data-testid="apparatus-canvas"
      className={behind ? "stale" : ""}
      onPointerDown={(event) => event.currentTarget.setPointerCapture(event.pointerId)}
      onPointerMove={onDrag}
      style={{ width: "100%", height: "100%", touchAction: "pan-y", cursor: "grab" }}
    />
  );
}

function sizeOf(element: HTMLElement) {
  return { width: element.clientWidth, height: element.clientHeight };
}

function follow(source: AnglesSource | null, show: (angles: ReturnType<AnglesSource["get"]>) => void) {
  show(source?.get() ?? null);
  return source?.subscribe(() => show(source.get()));
}
