import { type PointerEvent, useEffect, useRef } from "react";
import type { AnglesSource } from "./ghost";
import type { Limits, Motor } from "./limits";
import { Stage } from "./scene/stage";
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

/** The canvas. Angles go from their source to the stage, ten times a second, without React. */
export function Scene(props: SceneProps) {
  const { side, limits, view, only, real, ghost, label, onView, onUnable } = props;
  const place = useRef<HTMLDivElement>(null);
  const stage = useRef<Stage | null>(null);
  const latest = useRef({ view, only, onUnable });
  latest.current = { view, only, onUnable };

  useEffect(() => {
    const element = place.current;
    if (!element) return;
    // A canvas of its own for each stage: one whose context was given back gets no new one.
    const canvas = document.createElement("canvas");
    canvas.style.cssText = "width: 100%; height: 100%; display: block";
    let made: Stage;
    try {
      made = new Stage(canvas, side, limits);
    } catch {
      latest.current.onUnable();
      return;
    }
    stage.current = made;
    element.append(canvas);
    made.look(latest.current.view);
    made.single(latest.current.only);
    const fit = new ResizeObserver(() => made.resize(element.clientWidth, element.clientHeight));
    fit.observe(element);
    const lost = () => latest.current.onUnable();
    canvas.addEventListener("webglcontextlost", lost);
    return () => {
      canvas.removeEventListener("webglcontextlost", lost);
      fit.disconnect();
      made.dispose();
      canvas.remove();
      stage.current = null;
    };
  }, [side, limits]);

  useEffect(() => stage.current?.look(view), [view]);
  useEffect(() => stage.current?.single(only), [only]);
  // A new stage, for another side, is shown the same; so side and limits belong to what these follow.
  // biome-ignore lint/correctness/useExhaustiveDependencies: see above
  useEffect(() => follow(real, (angles) => stage.current?.show(angles)), [real, side, limits]);
  // biome-ignore lint/correctness/useExhaustiveDependencies: see above
  useEffect(() => follow(ghost, (angles) => stage.current?.haunt(angles)), [ghost, side, limits]);

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
      onPointerDown={(event) => event.currentTarget.setPointerCapture(event.pointerId)}
      onPointerMove={onDrag}
      style={{ width: "100%", height: "100%", touchAction: "pan-y", cursor: "grab" }}
    />
  );
}

function follow(source: AnglesSource | null, show: (angles: ReturnType<AnglesSource["get"]>) => void) {
  show(source?.get() ?? null);
  return source?.subscribe(() => show(source.get()));
}
