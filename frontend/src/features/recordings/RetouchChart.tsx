import "./catalogue";
import { type KeyboardEvent, type PointerEvent, type ReactNode, useRef } from "react";
import type { Schemas } from "../../lib/api/client";
import { formatDeg, formatDegrees } from "../../lib/format";
import { t } from "../../lib/i18n";
import { useWidth } from "../../ui/useWidth";
import { changeAt, clamp, knotsOf, MOST_DEG, marksRoom, roomOf, toHalf, toTenth } from "./retouch";
import classes from "./retouch.module.css";
import type { RetouchState } from "./useRetouch";

const HEIGHT = 320;
const LEFT = 44;
const RIGHT = 14;
const TOP = 10;
const BOTTOM = 30;
/** The knob of a mark is this far from the top. */
const MARK_Y = TOP + 12;
/** A finger reaches a knob within this distance in pixels. */
const REACH = 22;
const ROOM_DEG = 12;

type Limits = { min_deg: number; max_deg: number } | undefined;

/** Return functions between time or angle and pixels. Both curves fit. */
function scales(width: number, duration_s: number, angles: number[]) {
  const low = Math.min(...angles) - ROOM_DEG;
  const high = Math.max(...angles) + ROOM_DEG;
  const across = width - LEFT - RIGHT;
  const down = HEIGHT - TOP - BOTTOM;
  return {
    low,
    high,
    right: width - RIGHT,
    x: (time_s: number) => LEFT + (across * time_s) / duration_s,
    y: (deg: number) => TOP + (down * (high - deg)) / (high - low),
    secondsPerPixel: duration_s / across,
    degPerPixel: (high - low) / down,
  };
}
type Scales = ReturnType<typeof scales>;

/** Return round values between two numbers, at most seven. */
function ticks(low: number, high: number): number[] {
  const step = [1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1200].find((one) => (high - low) / one <= 6) ?? 3600;
  const first = Math.ceil(low / step);
  return Array.from({ length: Math.floor(high / step) - first + 1 }, (_, n) => (first + n) * step);
}

/** The angle at a time, between two samples of the motion. */
function angleAt(motion: Schemas["MotionPreview"], motor: number, time_s: number): number {
  const last = motion.times_s.length - 1;
  const place = Math.min(last, Math.max(0, (time_s / (motion.times_s[last] ?? 1)) * last));
  const angle = (n: number) => motion.angles_deg[n]?.[motor - 1] ?? 0;
  const share = place - Math.floor(place);
  return angle(Math.floor(place)) * (1 - share) + angle(Math.ceil(place)) * share;
}

/**
 * The taught curve of a motor, the changed curve over it, the angles beyond the motor's limits, and handles for
 * marks and points. Pointer and arrow keys move a handle.
 */
export function RetouchChart(props: {
  motion: Schemas["MotionPreview"];
  limits: Limits;
  retouch: RetouchState;
}) {
  const { motion, limits, retouch } = props;
  const { part, motor } = retouch;
  const { ref, width } = useWidth(640);
  const duration_s = motion.times_s.at(-1) ?? 1;
  const knots = knotsOf(part, motor);
  const before = motion.times_s.map((time_s) => ({ time_s, deg: angleAt(motion, motor, time_s) }));
  const after = before.map(({ time_s, deg }) => ({ time_s, deg: deg + changeAt(knots, time_s) }));
  const scale = scales(
    width,
    duration_s,
    [...before, ...after].map((place) => place.deg),
  );
  const line = (places: typeof before) =>
    places.map(({ time_s, deg }) => `${scale.x(time_s).toFixed(1)},${scale.y(deg).toFixed(1)}`).join(" ");
  return (
    <div ref={ref}>
      {/* biome-ignore lint/a11y/useSemanticElements: an SVG cannot be a fieldset */}
      <svg
        className={classes.chart}
        width={width}
        height={HEIGHT}
        viewBox={`0 0 ${width} ${HEIGHT}`}
        role="group"
        aria-label={t("recordings:retouch.chart", { motor })}
      >
        <rect
          className={classes.part}
          x={scale.x(part.start_s)}
          y={TOP}
          width={Math.max(0, scale.x(part.end_s) - scale.x(part.start_s))}
          height={HEIGHT - TOP - BOTTOM}
        />
        <Axes scale={scale} duration_s={duration_s} />
        <Beyond scale={scale} limits={limits} />
        <polyline className={classes.before} points={line(before)} />
        <polyline className={classes.after} points={line(after)} />
        <MarkHandles scale={scale} duration_s={duration_s} retouch={retouch} />
        {part.points.map((point, place) => (
          <PointHandle
            // biome-ignore lint/suspicious/noArrayIndexKey: a point keeps its place while it moves
            key={place}
            place={place}
            y={scale.y(angleAt(motion, motor, point.at_s) + point.change_deg)}
            scale={scale}
            retouch={retouch}
          />
        ))}
      </svg>
    </div>
  );
}

function Axes({ scale, duration_s }: { scale: Scales; duration_s: number }) {
  return (
    <g aria-hidden>
      {ticks(scale.low, scale.high).map((deg) => (
        <g key={deg}>
          <line className={classes.grid} x1={LEFT} x2={scale.right} y1={scale.y(deg)} y2={scale.y(deg)} />
          <text x={LEFT - 6} y={scale.y(deg) + 4} textAnchor="end">
            {formatDegrees(deg, 0)}
          </text>
        </g>
      ))}
      {ticks(0, duration_s).map((time_s) => (
        <text key={time_s} x={scale.x(time_s)} y={HEIGHT - 8} textAnchor="middle">
          {`${time_s} ${t("recordings:edit.seconds")}`}
        </text>
      ))}
    </g>
  );
}

/** Shades the angles beyond the motor's limits, as far as they are in view. */
function Beyond({ scale, limits }: { scale: Scales; limits: Limits }) {
  if (!limits) return null;
  const [top, bottom] = [TOP, HEIGHT - BOTTOM];
  const inside = (y: number) => clamp(y, { min: top, max: bottom });
  const [upper, lower] = [inside(scale.y(limits.max_deg)), inside(scale.y(limits.min_deg))];
  const width = scale.right - LEFT;
  return (
    <g aria-hidden>
      <rect className={classes.beyond} x={LEFT} y={top} width={width} height={upper - top} />
      <rect className={classes.beyond} x={LEFT} y={lower} width={width} height={bottom - lower} />
      {[upper, lower]
        .filter((y) => y > top && y < bottom)
        .map((y) => (
          <line key={y} className={classes.limit} x1={LEFT} x2={scale.right} y1={y} y2={y} />
        ))}
    </g>
  );
}

function MarkHandles(props: { scale: Scales; duration_s: number; retouch: RetouchState }) {
  const { scale, retouch } = props;
  const { part } = retouch;
  const room = marksRoom(part, props.duration_s);
  const marks = [
    { name: "start_s", label: t("recordings:edit.from"), room: room.start },
    { name: "end_s", label: t("recordings:edit.to"), room: room.end },
  ] as const;
  return marks.map((mark) => (
    <Handle
      key={mark.name}
      label={mark.label}
      value={part[mark.name]}
      bounds={mark.room}
      text={`${part[mark.name].toFixed(1)} ${t("recordings:edit.seconds")}`}
      x={scale.x(part[mark.name])}
      y={MARK_Y}
      onMove={(right, _, { from, step }) => {
        const time_s = from.x + (step === "key" ? right * 0.1 : right * scale.secondsPerPixel);
        retouch.change({ ...part, [mark.name]: clamp(toTenth(time_s), mark.room) }, step !== "drag");
      }}
      at={{ x: part[mark.name], y: 0 }}
    >
      <line
        className={classes.mark}
        x1={scale.x(part[mark.name])}
        x2={scale.x(part[mark.name])}
        y1={MARK_Y}
        y2={HEIGHT - BOTTOM}
      />
    </Handle>
  ));
}

function PointHandle(props: { place: number; y: number; scale: Scales; retouch: RetouchState }) {
  const { place, scale, retouch } = props;
  const { part, motor, selected } = retouch;
  const point = part.points[place];
  if (!point || point.motor !== motor) return null;
  const number = part.points.slice(0, place + 1).filter((one) => one.motor === motor).length;
  return (
    <Handle
      label={t("recordings:retouch.point", { number })}
      value={point.change_deg}
      bounds={{ min: -MOST_DEG, max: MOST_DEG }}
      text={t("recordings:retouch.at", { at: point.at_s.toFixed(1), change: formatDeg(point.change_deg) })}
      x={scale.x(point.at_s)}
      y={props.y}
      selected={place === selected}
      onFocus={() => retouch.select(place)}
      onDelete={() => {
        retouch.change({ ...part, points: part.points.filter((_, n) => n !== place) });
        retouch.select(null);
      }}
      at={{ x: point.at_s, y: point.change_deg }}
      onMove={(right, up, { from, step }) => {
        const [seconds, deg] = step === "key" ? [0.1, 0.5] : [scale.secondsPerPixel, scale.degPerPixel];
        const moved = {
          ...point,
          at_s: clamp(toTenth(from.x + right * seconds), roomOf(part, place)),
          change_deg: clamp(toHalf(from.y + up * deg), { min: -MOST_DEG, max: MOST_DEG }),
        };
        const points = part.points.map((one, n) => (n === place ? moved : one));
        retouch.change({ ...part, points }, step !== "drag");
      }}
    />
  );
}

type Value = { x: number; y: number };
/** `from`: the value at the start of the movement. Only the first movement of a drag is a step to undo. */
type Movement = { from: Value; step: "key" | "dragStart" | "drag" };

const ARROWS: Record<string, [number, number]> = {
  ArrowRight: [1, 0],
  ArrowLeft: [-1, 0],
  ArrowUp: [0, 1],
  ArrowDown: [0, -1],
};

/** A knob that pointer and arrow keys move. `onMove` gets the way to the right and up, in key steps or pixels. */
function Handle(props: {
  label: string;
  value: number;
  bounds: { min: number; max: number };
  text: string;
  x: number;
  y: number;
  at: Value;
  selected?: boolean;
  children?: ReactNode;
  onMove: (right: number, up: number, movement: Movement) => void;
  onFocus?: () => void;
  onDelete?: () => void;
}) {
  const { at, onMove } = props;
  const drag = useRef<{ x: number; y: number; from: Value; moved: boolean } | null>(null);
  const onKeyDown = (event: KeyboardEvent) => {
    const arrow = ARROWS[event.key];
    const times = event.shiftKey ? 10 : 1;
    if (arrow) onMove(arrow[0] * times, arrow[1] * times, { from: at, step: "key" });
    else if (event.key === "Delete" && props.onDelete) props.onDelete();
    else return;
    event.preventDefault();
  };
  const onPointerDown = (event: PointerEvent<SVGGElement>) => {
    event.currentTarget.setPointerCapture(event.pointerId);
    event.currentTarget.focus();
    drag.current = { x: event.clientX, y: event.clientY, from: at, moved: false };
  };
  const onPointerMove = (event: PointerEvent) => {
    const begun = drag.current;
    if (!begun) return;
    const [right, up] = [event.clientX - begun.x, begun.y - event.clientY];
    if (!begun.moved && Math.hypot(right, up) < 3) return;
    onMove(right, up, { from: begun.from, step: begun.moved ? "drag" : "dragStart" });
    begun.moved = true;
  };
  const stop = () => {
    drag.current = null;
  };
  return (
    <g
      className={classes.handle}
      role="slider"
      tabIndex={0}
      aria-label={props.label}
      aria-valuenow={props.value}
      aria-valuemin={props.bounds.min}
      aria-valuemax={props.bounds.max}
      aria-valuetext={props.text}
      data-selected={props.selected ?? false}
      onFocus={props.onFocus}
      onKeyDown={onKeyDown}
      onPointerDown={onPointerDown}
      onPointerMove={onPointerMove}
      onPointerUp={stop}
      onPointerCancel={stop}
    >
      {props.children}
      <circle className={classes.reach} cx={props.x} cy={props.y} r={REACH} />
      <circle className={classes.knob} cx={props.x} cy={props.y} r={8} />
    </g>
  );
}
