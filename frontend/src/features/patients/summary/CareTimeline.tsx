import { Text, Title } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { Link } from "@tanstack/react-router";
import { useState } from "react";
import type { Assessment, Episode, Schemas } from "../../../lib/api/client";
import { formatDayOf, formatList, formatMoment } from "../../../lib/format";
import { t } from "../../../lib/i18n";
import { timelineOf } from "../../../lib/patientQueries";
import { timeScale } from "../../../ui/timeScale";
import ui from "../../../ui/ui.module.css";
import { useWidth } from "../../../ui/useWidth";
import { stageSpans, timelineEnds } from "./careTimeline";
import classes from "./summary.module.css";

const HEIGHT = 118;
const [STAGES, VISITS, ASSESSED, DAYS] = [8, 54, 84, 112];
const MARGIN = 8;

/** Shows the episode's stages, sessions, stops and assessments along one time axis. */
export function CareTimeline({ episode, assessments }: { episode: Episode; assessments: Assessment[] }) {
  const { ref, width } = useWidth(700);
  const [now] = useState(() => new Date().toISOString());
  const listed = useQuery(timelineOf(episode.patient_id));
  // The patient's other shoulder may have sessions, too.
  const sessions = (listed.data?.items ?? []).filter(({ episode_id }) => episode_id === episode.id);
  const title = t("patients:summary.timeline");
  const right = width - MARGIN;
  const x = timeScale(timelineEnds(episode, sessions, now), MARGIN, right);
  return (
    <section aria-label={title} ref={ref}>
      <Title order={2} size="h4">
        {title}
      </Title>
      <Text size="sm">{describeTimeline(sessions, episode)}</Text>
      {/* The tab of sessions has the same links, so screen readers and the tab key skip these. */}
      <svg className={ui.chart} width={width} height={HEIGHT} viewBox={`0 0 ${width} ${HEIGHT}`} aria-hidden>
        <Stages episode={episode} until={episode.closed_at ?? now} x={x} right={right} />
        <line className={ui.grid} x1={MARGIN} x2={right} y1={VISITS} y2={VISITS} />
        {sessions.map((session) => (
          <Visit key={session.id} session={session} x={x(session.started_at)} />
        ))}
        {assessments
          .filter(({ withdrawn_at }) => !withdrawn_at)
          .map(({ id, assessed_at }) => (
            <path
              key={id}
              d={`M${x(assessed_at)} ${ASSESSED - 7}l7 7l-7 7l-7 -7z`}
              fill="none"
              stroke="var(--mantine-color-text)"
              strokeWidth={2}
            >
              <title>{t("patients:summary.assessedAt", { moment: formatMoment(assessed_at) })}</title>
            </path>
          ))}
        {x.ends.map((at, n) => (
          <text key={at} className={ui.faint} x={x(at)} y={DAYS} textAnchor={n === 0 ? "start" : "end"}>
            {formatDayOf(at)}
          </text>
        ))}
      </svg>
      <Keys />
    </section>
  );
}

/** Return the content of the figure in words. */
function describeTimeline(sessions: Schemas["SessionSummary"][], episode: Episode): string {
  const stops = sessions.filter((session) => session.stops > 0).length;
  const stage = episode.stage
    ? [t(`episodes:stageList.since.${episode.stage.stage}`, { day: formatDayOf(episode.stage.since) })]
    : [];
  return formatList([
    t("patients:summary.sessions", { count: sessions.length }),
    t("patients:summary.stops", { count: stops }),
    ...stage,
  ]);
}

function Stages(props: { episode: Episode; until: string; x: (at: string) => number; right: number }) {
  return stageSpans(props.episode.stages, props.until).map(({ stage, from, to }) => {
    const [start, end] = [props.x(from), Math.min(props.right, props.x(to))];
    const name = t(`episodes:stages.${stage}`);
    return (
      <g key={from}>
        <rect
          className={classes.stage}
          data-stage={stage}
          x={start}
          y={STAGES}
          width={Math.max(2, end - start)}
          height={24}
        />
        {end - start > 8 * name.length && (
          <text x={start + 6} y={STAGES + 17}>
            {name}
          </text>
        )}
      </g>
    );
  });
}

function Visit({ session, x }: { session: Schemas["SessionSummary"]; x: number }) {
  const stopped = session.stops > 0;
  return (
    <Link to="/sessions/$sessionId" params={{ sessionId: session.id }} tabIndex={-1} preload={false}>
      <title>
        {t(stopped ? "patients:summary.stoppedAt" : "patients:summary.heldAt", {
          moment: formatMoment(session.started_at),
        })}
      </title>
      {stopped ? (
        <rect className={classes.stopped} x={x - 7} y={VISITS - 7} width={14} height={14} strokeWidth={2} />
      ) : (
        <circle className={classes.visit} cx={x} cy={VISITS} r={6} strokeWidth={1} />
      )}
    </Link>
  );
}

function Keys() {
  return (
    <div className={ui.legend} aria-hidden>
      <span>
        <svg width={16} height={14} aria-hidden>
          <circle className={classes.visit} cx={8} cy={7} r={6} />
        </svg>
        {t("patients:summary.keys.session")}
      </span>
      <span>
        <svg width={16} height={14} aria-hidden>
          <rect className={classes.stopped} x={2} y={1} width={12} height={12} strokeWidth={2} />
        </svg>
        {t("patients:summary.keys.stopped")}
      </span>
      <span>
        <svg width={16} height={14} aria-hidden>
          <path d="M8 1l6 6l-6 6l-6 -6z" fill="none" stroke="var(--mantine-color-text)" strokeWidth={2} />
        </svg>
        {t("patients:summary.keys.assessment")}
      </span>
    </div>
  );
}
