import { Title, VisuallyHidden } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { Link } from "@tanstack/react-router";
import { api, type Run, type Schemas, type Session } from "../../lib/api/client";
import { formatClock } from "../../lib/format";
import { t } from "../../lib/i18n";
import { translateServerText } from "../../lib/serverText";
import { type TimeScale, timeScale } from "../../ui/timeScale";
import ui from "../../ui/ui.module.css";
import { useWidth } from "../../ui/useWidth";
import classes from "./sessions.module.css";

const HEIGHT = 68;
const [BAR, BAR_HEIGHT, MARKS, CLOCK] = [4, 26, 40, 64];
const MARGIN = 10;
/** Minimum width of a playback in pixels, so that the user can press it. */
const LEAST = 18;

/** Shows the playbacks of a session on its clock, with stops and resistance. Pressing a playback chooses it. */
export function SessionTimeline({ session, chosen }: { session: Session; chosen: number }) {
  const { ref, width } = useWidth(700);
  const reversals = useQuery({
    queryKey: ["session", session.id, "reversals"],
    queryFn: () => api.sessionReversals(session.id),
  });
  const alarms = useQuery({
    queryKey: ["session", session.id, "alarms"],
    queryFn: () => api.sessionAlarms(session.id),
  });
  const stops = alarms.data?.items ?? [];
  const marks = [
    ...stops.map((alarm) => markOf(alarm, "stop")),
    ...stopsOfRuns(session.runs, stops),
    ...(reversals.data?.items ?? []).map((event) => markOf(event, "resistance")),
  ];
  if (session.runs.length === 0) return null;
  const right = width - MARGIN;
  const x = timeScale(momentsOf(session, marks), MARGIN, right);
  return (
    <section aria-label={t("sessions:timeline.title")} ref={ref}>
      <VisuallyHidden>
        <Title order={2}>{t("sessions:timeline.title")}</Title>
        <ol>
          {describe(session, marks).map(({ key, words }) => (
            <li key={key}>{words}</li>
          ))}
        </ol>
      </VisuallyHidden>
      <svg className={ui.chart} width={width} height={HEIGHT} viewBox={`0 0 ${width} ${HEIGHT}`} aria-hidden>
        <line className={ui.grid} x1={MARGIN} x2={right} y1={BAR + BAR_HEIGHT} y2={BAR + BAR_HEIGHT} />
        {session.runs.map((run, runIndex) => (
          <Playback
            key={run.id}
            run={run}
            runIndex={runIndex}
            chosen={runIndex === chosen}
            x={x}
            right={right}
          />
        ))}
        {marks.map((mark) => (
          <MarkShape key={mark.id} mark={mark} x={x(mark.at)} />
        ))}
        {x.ends.map((at, n) => (
          <text key={at} className={ui.faint} x={x(at)} y={CLOCK} textAnchor={n === 0 ? "start" : "end"}>
            {formatClock(new Date(at))}
          </text>
        ))}
      </svg>
    </section>
  );
}

type DeviceEvent = Schemas["DeviceEvent"];
/** An event at one moment. */
type Mark = { id: string; at: string; kind: "stop" | "resistance"; words: string };

const markOf = (event: DeviceEvent, kind: Mark["kind"]): Mark => ({
  id: event.id,
  at: event.at,
  kind,
  words: describeEvent(event.at, translateServerText(event.message, event.message_key)),
});

/** Return, at their ends, the stops of playbacks whose alarm is not recorded. */
export function stopsOfRuns(runs: Run[], alarms: Pick<DeviceEvent, "run_id">[]): Mark[] {
  return runs.flatMap(({ id, stop, started_at, ended_at }) => {
    if (!stop || alarms.some(({ run_id }) => run_id === id)) return [];
    const at = ended_at ?? started_at;
    const words = describeEvent(at, translateServerText(stop.message, stop.message_key));
    return [{ id: `stop ${id}`, at, kind: "stop" as const, words }];
  });
}

/** Return the times that the timeline must cover. */
const momentsOf = (session: Session, marks: Mark[]) => [
  session.started_at,
  ...(session.ended_at ? [session.ended_at] : []),
  ...session.runs.flatMap((run) => [run.started_at, run.ended_at ?? run.started_at]),
  ...marks.map(({ at }) => at),
];

function Playback(props: { run: Run; runIndex: number; chosen: boolean; x: TimeScale; right: number }) {
  const { run, runIndex, chosen, x, right } = props;
  const width = Math.max(LEAST, x(run.ended_at ?? run.started_at) - x(run.started_at));
  const start = Math.min(x(run.started_at), right - width);
  return (
    <Link
      from="/sessions/$sessionId"
      to="."
      search={(before) => ({ ...before, run: runIndex + 1 })}
      replace
      tabIndex={-1}
    >
      <title>{describeRun(run, runIndex)}</title>
      <rect
        className={classes.playback}
        data-outcome={run.outcome}
        data-chosen={chosen}
        x={start}
        y={BAR}
        width={width}
        height={BAR_HEIGHT}
      />
      <text className={classes.number} x={start + width / 2} y={BAR + 18} textAnchor="middle">
        {runIndex + 1}
      </text>
    </Link>
  );
}

/** Draws a square for a stop and a triangle for resistance. */
function MarkShape({ mark, x }: { mark: Mark; x: number }) {
  return (
    <g>
      <title>{mark.words}</title>
      {mark.kind === "stop" ? (
        <rect className={classes.mark} x={x - 6} y={MARKS - 6} width={12} height={12} />
      ) : (
        <path className={classes.mark} d={`M${x} ${MARKS - 7}l7 13h-14z`} />
      )}
    </g>
  );
}

/** Return every entry of the timeline in words, in order. */
function describe(session: Session, marks: Mark[]) {
  return [
    ...session.runs.map((run, runIndex) => ({
      key: run.id,
      at: run.started_at,
      words: describeRun(run, runIndex),
    })),
    ...marks.map(({ id, at, words }) => ({ key: id, at, words })),
  ].sort((a, b) => Date.parse(a.at) - Date.parse(b.at));
}

const describeRun = (run: Run, runIndex: number) =>
  t("sessions:timeline.playback", {
    at: formatClock(new Date(run.started_at)),
    number: runIndex + 1,
    recording: run.recording_name,
    outcome: t(`sessions:outcomes.${run.outcome}`),
  });

const describeEvent = (at: string, what: string) =>
  t("sessions:timeline.event", { at: formatClock(new Date(at)), what });
