import "./catalogue";
import type { Schemas } from "../../lib/api/client";
import { formatDegrees } from "../../lib/format";
import { t } from "../../lib/i18n";
import { useWidth } from "../../ui/useWidth";
import { type ArmPoint, LIMIT_DEG, type LiveMotion, type SoundMotion, soundCurveOf } from "./liveRhythm";
import classes from "./liveRhythm.module.css";

const HEIGHT = 218;
const LEFT = 40;
const RIGHT = 22;
const TOP = 8;
const BOTTOM = 22;
/** Range of the chart. It grows with the curves. */
const ELEVATION = { low: 0, high: 120, step: 30 };
const SCAPULA = { low: -5, high: 22, step: 5 };

/** The scapula over the elevation of the arm: sound side, this motion, its last ten seconds, and the arm now. */
export function LiveRhythmChart(props: {
  rhythm: Schemas["RhythmLive"];
  sound: SoundMotion[];
  motion: LiveMotion | null;
  now: ArmPoint | null;
}) {
  const { rhythm, sound, motion, now } = props;
  const { ref, width } = useWidth(480);
  const trail = motion?.id === rhythm.motion_id ? motion.trail : [];
  const like = rhythm.curves.map((curve) => soundCurveOf(curve, sound)).filter((curve) => curve !== null);
  // Until the plane of the motion is known, the newest motion of the sound side is shown.
  const others = rhythm.curves.length > 0 ? like : (sound[0]?.curves ?? []);
  const lowest = Math.min(
    SCAPULA.low,
    ...trail.map((point) => point.scapula_deg),
    ...others.flatMap((curve) => curve.scapula_deg),
  );
  const highest = Math.max(ELEVATION.high, ...trail.map((point) => point.elevation_deg));
  const x = (deg: number) =>
    LEFT + ((width - LEFT - RIGHT) * (deg - ELEVATION.low)) / (highest - ELEVATION.low);
  const y = (deg: number) => TOP + ((HEIGHT - TOP - BOTTOM) * (SCAPULA.high - deg)) / (SCAPULA.high - lowest);
  const path = (xs: number[], ys: number[]) =>
    xs.map((deg, n) => `${x(deg).toFixed(1)},${y(ys[n] ?? 0).toFixed(1)}`).join(" ");
  return (
    <div ref={ref}>
      <svg
        className={classes.chart}
        width={width}
        height={HEIGHT}
        viewBox={`0 0 ${width} ${HEIGHT}`}
        role="img"
        aria-label={t("rhythm:figure")}
      >
        <Axes x={x} y={y} lowest={lowest} highest={highest} right={width - RIGHT} />
        {others.map((curve) => (
          <polyline
            key={`${curve.direction} ${curve.plane_deg}`}
            className={classes.sound}
            data-direction={curve.direction}
            points={path(curve.elevation_deg, curve.scapula_deg)}
          />
        ))}
        {/* Below the curves, whose colours would otherwise not be those of the legend. */}
        <polyline
          className={classes.trail}
          points={path(
            trail.map((point) => point.elevation_deg),
            trail.map((point) => point.scapula_deg),
          )}
        />
        {rhythm.curves.map((curve) => (
          <polyline
            key={`${curve.direction} ${curve.plane_deg}`}
            className={classes.own}
            data-direction={curve.direction}
            points={path(curve.elevation_deg, curve.scapula_deg)}
          />
        ))}
        {now && (
          <circle
            className={classes.now}
            data-ahead={motion?.ahead ?? false}
            cx={x(now.elevation_deg)}
            cy={y(now.scapula_deg)}
            r={7}
          />
        )}
      </svg>
      {/* Outside the drawing, so that it takes a second line on a telephone. */}
      <p className={classes.axes} aria-hidden>
        {t("rhythm:live.axes")}
      </p>
      <Keys sound={others.length > 0} />
      {now && (
        <p className={classes.values} data-testid="arm-now">
          {t("rhythm:live.now", {
            elevation: formatDegrees(now.elevation_deg, 0),
            scapula: formatDegrees(now.scapula_deg),
          })}
        </p>
      )}
    </div>
  );
}

function Axes(props: {
  x: (deg: number) => number;
  y: (deg: number) => number;
  lowest: number;
  highest: number;
  right: number;
}) {
  const { x, y, right } = props;
  return (
    <g aria-hidden>
      {steps(props.lowest, SCAPULA.high, SCAPULA.step).map((deg) => (
        <g key={deg}>
          <line className={classes.grid} x1={LEFT} x2={right} y1={y(deg)} y2={y(deg)} />
          <text x={LEFT - 6} y={y(deg) + 4} textAnchor="end">
            {formatDegrees(deg, 0)}
          </text>
        </g>
      ))}
      {steps(ELEVATION.low, props.highest, ELEVATION.step).map((deg) => (
        <g key={deg}>
          <line className={classes.grid} x1={x(deg)} x2={x(deg)} y1={TOP} y2={HEIGHT - BOTTOM} />
          <text x={x(deg)} y={HEIGHT - BOTTOM + 16} textAnchor="middle">
            {formatDegrees(deg, 0)}
          </text>
        </g>
      ))}
      <line className={classes.limit} x1={LEFT} x2={right} y1={y(LIMIT_DEG)} y2={y(LIMIT_DEG)} />
    </g>
  );
}

function steps(low: number, high: number, step: number): number[] {
  const first = Math.ceil(low / step);
  return Array.from({ length: Math.floor(high / step) - first + 1 }, (_, n) => (first + n) * step);
}

function Keys({ sound }: { sound: boolean }) {
  const sample = (line: string | undefined, direction?: string) => (
    <svg width={28} height={10} aria-hidden>
      <line className={line ?? ""} data-direction={direction} x1={0} x2={28} y1={5} y2={5} />
    </svg>
  );
  return (
    <div className={classes.keys}>
      <span>
        {sample(classes.own)} {t("rhythm:live.own")}
      </span>
      {sound && (
        <span>
          {sample(classes.sound)} {t("rhythm:of.sound")}
        </span>
      )}
      <span>
        {sample(classes.dashes, "lowering")} {t("rhythm:live.lowering")}
      </span>
      <span>
        {sample(classes.limit)} {t("rhythm:limit")}
      </span>
    </div>
  );
}
