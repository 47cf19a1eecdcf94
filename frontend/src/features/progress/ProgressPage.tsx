import { Group, Skeleton, Stack, Text, Title } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { useParams, useSearch } from "@tanstack/react-router";
import { useTitle } from "../../app/title";
import { api, type Chart } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { useEpisodes } from "../../lib/patientQueries";
import { PageLink } from "../../ui/links";
import { Plot } from "../../ui/Plot";
import { ProblemNote } from "../../ui/ProblemNote";
import { withLocalDays } from "./days";
import { NumbersTable } from "./NumbersTable";

/** The progress of an episode: all charts and their data. */
export function ProgressPage() {
  const { episodeId } = useParams({ from: "/episodes/$episodeId/progress" });
  const { patient: patientId } = useSearch({ from: "/episodes/$episodeId/progress" });
  useTitle(t("progress:progress.title"));
  return (
    <Stack gap="xl">
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

/** Empty if the address names another patient than the episode's. */
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

function ProgressChart({ chart, episodeId }: { chart: Chart; episodeId: string }) {
  const title = t(`progress:charts.${chart}.title`);
  const shows = t(`progress:charts.${chart}.shows`);
  const nothing = t(`progress:charts.${chart}.nothing`);
  const progress = useQuery({
    queryKey: ["progress", episodeId, chart],
    queryFn: () => api.progress(episodeId, chart),
    select: ({ figure, table }) => ({ figure: withLocalDays(figure), table }),
  });
  const chartData = progress.data;
  return (
    <Stack gap="xs" component="section" aria-label={title}>
      <Title order={2} size="h3">
        {title}
      </Title>
      <ProblemNote error={progress.error} />
      {progress.isPending && <Skeleton h={340} />}
      {chartData && chartData.table.rows.length === 0 && <Text>{nothing}</Text>}
      {chartData && chartData.table.rows.length > 0 && (
        <>
          <Text size="sm">{shows}</Text>
          <Plot figure={chartData.figure} label={t("progress:progress.figure", { title, shows })} />
          <NumbersTable title={title} table={chartData.table} />
        </>
      )}
    </Stack>
  );
}
