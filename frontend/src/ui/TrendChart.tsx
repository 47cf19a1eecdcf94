import { formatDayOf, formatMeasured, formatShortDays } from "../lib/format";
import { timeScale } from "./timeScale";
import classes from "./ui.module.css";
import { useWidth } from "./useWidth";

/** One line of a trend. `at` is a time such as 2026-11-25T09:30:00Z. */
export type Trend = { name: string; points: { at: string; value: number }[] };

const HEIGHT = 150;
/** Below this width in pixels, two days with their years do not fit below the chart, where letters are larger on paper. */
const NARROW = 420;
const [LEFT, RIGHT, TOP, BOTTOM] = [30, 46, 10, 22];
/** Colour, dash and marker of each line. The lines also differ without colour. */
const LOOKS = [
  { colour: "var(--kata-setpoint)", dash: "", marker: "circle" },
  { colour: "var(--kata-measured)", dash: "5 4", marker: "square" },
] as const;

/** A small chart of at most two values over time. `label` describes the chart for users who cannot see it. */
export function TrendChart(props: { label: string; trends: Trend[]; max: number; step: number }) {
  const { ref, width } = useWidth(360);
  const { max, step } = props;
  const points = props.trends.flatMap((trend) => trend.points);
  const x = timeScale(
    points.map(({ at }) => at),
    LEFT,
    width - RIGHT,
  );
  const y = (value: number) => HEIGHT - BOTTOM - (value / max) * (HEIGHT - TOP - BOTTOM);
  const days = width < NARROW ? formatShortDays(x.ends) : x.ends.map(formatDayOf);
  const ticks = Array.from({ length: max / step + 1 }, (_, n) => n * step);
  return (
    <div ref={ref} style={{ minHeight: HEIGHT }}>
      <svg
        className={classes.chart}
        width={width}
        height={HEIGHT}
        viewBox={`0 0 ${width} ${HEIGHT}`}
        role="img"
        aria-label={props.label}
      >
        {ticks.map((tick) => (
          <g key={tick}>
            <line className={classes.grid} x1={LEFT} x2={width - RIGHT} y1={y(tick)} y2={y(tick)} />
            <text className={classes.faint} x={LEFT - 6} y={y(tick) + 4} textAnchor="end">
              {tick}
            </text>
          </g>
        ))}
        {x.ends.map((at, n) => (
          <text
            key={at}
            className={classes.faint}
            x={x(at)}
            y={HEIGHT - 4}
            textAnchor={n === 0 ? "start" : "end"}
          >
            {days[n]}
          </text>
        ))}
        {props.trends.map((trend, n) => (
          <Line key={trend.name} trend={trend} look={LOOKS[n % LOOKS.length]} x={x} y={y} />
        ))}
      </svg>
    </div>
  );
}

function Line(props: {
  trend: Trend;
  look: (typeof LOOKS)[number] | undefined;
  x: (at: string) => number;
  y: (value: number) => number;
}) {
  const { trend, x, y } = props;
  const { colour, dash, marker } = props.look ?? LOOKS[0];
  const last = trend.points.at(-1);
  return (
    <g>
      <polyline
        points={trend.points.map(({ at, value }) => `${x(at)},${y(value)}`).join(" ")}
        fill="none"
        stroke={colour}
        strokeWidth={2}
        strokeDasharray={dash}
      />
      {trend.points.map(({ at, value }) =>
        marker === "circle" ? (
          <circle key={at} cx={x(at)} cy={y(value)} r={3.5} fill={colour} />
        ) : (
          <rect key={at} x={x(at) - 3.5} y={y(value) - 3.5} width={7} height={7} fill={colour} />
        ),
      )}
      {last && (
        <text x={x(last.at) + 8} y={y(last.value) + 4} fontWeight={700}>
          {formatMeasured(last.value)}
        </text>
      )}
    </g>
  );
}

/** Shows the name of each line beside a sample of it. */
export function TrendLegend({ trends }: { trends: Trend[] }) {
  return (
    <div className={classes.legend}>
      {trends.map((trend, n) => {
        const look = LOOKS[n % LOOKS.length] ?? LOOKS[0];
        return (
          <span key={trend.name}>
            <svg width={28} height={10} aria-hidden>
              <line
                x1={0}
                x2={28}
                y1={5}
                y2={5}
                stroke={look.colour}
                strokeWidth={2}
                strokeDasharray={look.dash}
              />
            </svg>
            {trend.name}
          </span>
        );
      })}
    </div>
  );
}
