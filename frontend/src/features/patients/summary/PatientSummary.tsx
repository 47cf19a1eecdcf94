import { Card, Skeleton, Stack, Text } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import type { Episode, Patient } from "../../../lib/api/client";
import { t } from "../../../lib/i18n";
import {
  ASSESSMENT_FORM,
  useAssessments,
  useEpisodes,
  useNewestSession,
  useSummaryPrefetch,
} from "../../../lib/patientQueries";
import { ProblemNote } from "../../../ui/ProblemNote";
import { CareTimeline } from "./CareTimeline";
import { LastSession } from "./LastSession";
import { ProgrammeSummary } from "./ProgrammeSummary";
import { RomFigure } from "./RomFigure";
import { SinceLastMonth } from "./SinceLastMonth";
import { sinceLastMonth } from "./sinceLastMonth";
import classes from "./summary.module.css";
import { Trends } from "./Trends";

/** Shows the patient's change, range of motion, pain, timeline, programme and last session. */
export function PatientSummary({ patient }: { patient: Patient }) {
  const episodes = useEpisodes(patient.id);
  useSummaryPrefetch(patient.id, patient.episode_id);
  // The last session is at the end of the summary, and its request takes longest.
  useNewestSession(patient.id);
  const episode = episodes.data?.items.find(({ id }) => id === patient.episode_id);
  return (
    <Stack gap="sm">
      {patient.notes && <Text style={{ whiteSpace: "pre-wrap" }}>{patient.notes}</Text>}
      <ProblemNote error={episodes.error} />
      {episodes.data && !episode && (
        <>
          <Text>{t("episodes:care.none")}</Text>
          <Card withBorder>
            <LastSession patientId={patient.id} />
          </Card>
        </>
      )}
      {episode && <EpisodeSummary key={episode.id} episode={episode} />}
    </Stack>
  );
}

function EpisodeSummary({ episode }: { episode: Episode }) {
  const form = useQuery(ASSESSMENT_FORM);
  const assessments = useAssessments(episode.id);
  const items = assessments.items ?? [];
  const baseline = assessments.data?.pages[0]?.baseline ?? null;
  const compared = sinceLastMonth(items, baseline);
  const error = form.error ?? assessments.error;
  if (error) return <ProblemNote error={error} />;
  if (!form.data || !assessments.items) return <Skeleton h={560} />;
  return (
    <>
      <Text fw={600}>{t(`episodes:care.shoulder.${episode.side}`)}</Text>
      {compared ? (
        <SinceLastMonth compared={compared} side={episode.side} form={form.data} />
      ) : (
        <Text>{t("assessments:assessments.none")}</Text>
      )}
      <div className={classes.columns}>
        <Stack gap="sm">
          {compared && (
            <Card withBorder>
              <RomFigure
                form={form.data}
                newest={compared.newest}
                baseline={baseline}
                affected={episode.side}
              />
            </Card>
          )}
          <Card withBorder>
            <CareTimeline episode={episode} assessments={items} />
          </Card>
          <Card withBorder>
            <ProgrammeSummary patientId={episode.patient_id} episodeId={episode.id} />
          </Card>
        </Stack>
        <Stack gap="sm">
          {compared && (
            <Card withBorder>
              <Trends assessments={items} side={episode.side} />
            </Card>
          )}
          <Card withBorder>
            <LastSession patientId={episode.patient_id} />
          </Card>
        </Stack>
      </div>
    </>
  );
}
