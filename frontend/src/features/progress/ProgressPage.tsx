import { Group, Stack, Text, Title } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { useParams, useSearch } from "@tanstack/react-router";
import { useTitle } from "../../app/title";
import { api, type Chart } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { useEpisodes } from "../../lib/patientQueries";
import { PageLink } from "../../ui/links";
import { PatientBanner } from "../patients/PatientBanner";
import { ProgressChart } from "./ProgressChart";

/** The progress of an episode: all charts and their data. */
export function ProgressPage() {
  const { episodeId } = useParams({ from: "/episodes/$episodeId/progress" });
  const { patient: patientId } = useSearch({ from: "/episodes/$episodeId/progress" });
  useTitle(t("progress:progress.title"));
  const episode = useQuery({ queryKey: ["episode", episodeId], queryFn: () => api.episode(episodeId) });
  return (
    <Stack gap="xl">
      <PatientBanner patientId={episode.data?.patient_id} />
      <div>
        {patientId !== undefined && <Whose patientId={patientId} episodeId={episodeId} />}
        <Title order={1} size="h2">
          {t("progress:progress.title")}
        </Title>
        <Text>{t("progress:progress.weeks")}</Text>
      </div>
      {(Object.keys(t("progress:charts", { returnObjects: true })) as Chart[]).map((chart) => (
        <ProgressChart key={chart} episodeId={episodeId} chart={chart} />
      ))}
    </Stack>
  );
}

/** Shows the patient's name. Renders nothing if the patient in the address is not the episode's. */
export function Whose({ patientId, episodeId }: { patientId: string; episodeId: string }) {
  const patient = useQuery({ queryKey: ["patient", patientId], queryFn: () => api.patient(patientId) });
  const episode = useEpisodes(patientId).data?.items.find((candidate) => candidate.id === episodeId);
  if (!patient.data || !episode) return null;
  return (
    <Group gap="lg">
      <PageLink to="/patients/$patientId" params={{ patientId }}>
        {patient.data.name}
      </PageLink>
      <Text>{t(`episodes:care.shoulder.${episode.side}`)}</Text>
    </Group>
  );
}
