import "../../programmes/catalogue";
import { Text, Title } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import type { Schemas } from "../../../lib/api/client";
import { formatDay } from "../../../lib/format";
import { t } from "../../../lib/i18n";
import { programmesOf } from "../../../lib/patientQueries";
import { PageLink } from "../../../ui/links";
import { ProblemNote } from "../../../ui/ProblemNote";
import { describeItem, describeVersion } from "../../programmes/describeProgramme";
import { Regularity, useAdherence } from "../../programmes/Programmes";
import classes from "./summary.module.css";

/** Number of weeks that the bars show. */
const WEEKS = 10;

/** Shows the episode's present programme and how regularly the patient follows it. */
export function ProgrammeSummary({ patientId, episodeId }: { patientId: string; episodeId: string }) {
  const programmes = useQuery(programmesOf(patientId));
  const present = programmes.data?.items.find(
    (programme) => !programme.archived_at && programme.episode_id === episodeId,
  );
  const title = t("patients:summary.programme");
  return (
    <section aria-label={title}>
      <Title order={2} size="h4">
        {title}
      </Title>
      <ProblemNote error={programmes.error} />
      {programmes.data && !present && <Text>{t("programmes:programme.none")}</Text>}
      {present && (
        <>
          <Text>
            <PageLink to="/programmes/$programmeId" params={{ programmeId: present.id }} fw={700}>
              {present.name}
            </PageLink>
          </Text>
          {present.current.items.map((item) => (
            <Text key={item.position} size="sm">
              {t("programmes:programme.item", { recording: item.recording_name, played: describeItem(item) })}
            </Text>
          ))}
          <Text size="sm" c="dimmed">
            {describeVersion(present.current)}
          </Text>
          <Regularity episodeId={present.episode_id} />
          <WeekBars episodeId={present.episode_id} />
        </>
      )}
    </section>
  );
}

/** Shows the sessions of the last weeks as bars, and the prescribed number as a dashed line. */
function WeekBars({ episodeId }: { episodeId: string }) {
  const weeks = (useAdherence(episodeId).data?.weeks ?? []).slice(-WEEKS);
  const [first] = weeks;
  if (!first) return null;
  const most = Math.max(1, ...weeks.flatMap((week) => [week.sessions, week.sessions_prescribed ?? 0]));
  const share = (sessions: number) => `${(100 * sessions) / most}%`;
  return (
    <>
      <div className={classes.weeks} role="img" aria-label={describeWeeks(weeks)}>
        {weeks.map((week) => (
          <div key={week.begins_on} className={classes.week} style={{ height: share(week.sessions) }}>
            {week.sessions_prescribed !== null && (
              <div
                className={classes.wished}
                style={{ bottom: `${(56 * week.sessions_prescribed) / most - 1}px` }}
              />
            )}
          </div>
        ))}
      </div>
      <Text size="sm" c="dimmed">
        {t("patients:summary.weeksFrom", { day: formatDay(first.begins_on) })}
      </Text>
    </>
  );
}

const describeWeeks = (weeks: Schemas["AdherenceWeek"][]) =>
  t("patients:summary.weeks", {
    list: weeks.map((week) =>
      week.sessions_prescribed === null ? `${week.sessions}` : `${week.sessions}/${week.sessions_prescribed}`,
    ),
  });
