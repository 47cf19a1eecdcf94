import { Skeleton, Stack, Text, Title } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { useParams, useSearch } from "@tanstack/react-router";
import { api, type Chart } from "../api/client";
import { PageLink } from "../shared/links";
import { Plot } from "../shared/Plot";
import { ProblemNote } from "../shared/problem";
import { useTitle } from "../shared/title";
import { withLocalDays } from "./days";
import { NumbersTable } from "./NumbersTable";

/** What each chart is called, what it shows, and what is said where there is nothing yet. */
const CHARTS: { chart: Chart; title: string; shows: string; nothing: string }[] = [
  {
    chart: "rom",
    title: "Range of motion",
    shows:
      "The affected shoulder over the weeks, with its first measurement, the other shoulder and the reference.",
    nothing: "No range of motion has been measured yet.",
  },
  {
    chart: "pain",
    title: "Pain",
    shows: "0 to 10, as it was told in assessments and around sessions.",
    nothing: "Nobody has been asked for pain yet.",
  },
  {
    chart: "spadi",
    title: "SPADI",
    shows:
      "Less is better. In the shaded band an improvement is perhaps important to the patient, below it surely.",
    nothing: "No SPADI has been filled in yet.",
  },
  {
    chart: "tracking",
    title: "How well recordings were reproduced",
    shows: "Playback against what was asked for, of the motor that did worst, by recording and method.",
    nothing: "Nothing has been played and compared yet.",
  },
  {
    chart: "correction",
    title: "Learned correction",
    shows:
      "How much the learned method had come to correct by the end of each session, in the motor it corrects most.",
    nothing: "Nothing has been played by the learned method yet.",
  },
  {
    chart: "adherence",
    title: "Sessions a week",
    shows: "Sessions in which something was played, and how many there were to be by the programme.",
    nothing: "There has been no session yet.",
  },
];

/** An episode over its weeks: every chart, and the numbers behind it. */
export function ProgressPage() {
  const { episodeId } = useParams({ from: "/episodes/$episodeId/progress" });
  const { patient: patientId } = useSearch({ from: "/episodes/$episodeId/progress" });
  const patient = useQuery({
    queryKey: ["patient", patientId],
    queryFn: () => api.patient(patientId ?? ""),
    enabled: patientId !== undefined,
  });
  useTitle("Progress");
  return (
    <Stack gap="xl">
      <div>
        {patient.data && (
          <PageLink to="/patients/$patientId" params={{ patientId: patient.data.id }}>
            {patient.data.name}
          </PageLink>
        )}
        <Title order={1} size="h2">
          Progress
        </Title>
        <Text>Weeks are counted from the first assessment or session.</Text>
      </div>
      {CHARTS.map((one) => (
        <ProgressChart key={one.chart} episodeId={episodeId} {...one} />
      ))}
    </Stack>
  );
}

function ProgressChart(props: (typeof CHARTS)[number] & { episodeId: string }) {
  const { chart, episodeId, title } = props;
  const progress = useQuery({
    queryKey: ["progress", episodeId, chart],
    queryFn: () => api.progress(episodeId, chart),
    select: ({ figure, table }) => ({ figure: withLocalDays(figure), table }),
  });
  const found = progress.data;
  return (
    <Stack gap="xs" component="section" aria-label={title}>
      <Title order={2} size="h3">
        {title}
      </Title>
      <ProblemNote error={progress.error} />
      {progress.isPending && <Skeleton h={340} />}
      {found && found.table.rows.length === 0 && <Text>{props.nothing}</Text>}
      {found && found.table.rows.length > 0 && (
        <>
          <Text size="sm">{props.shows}</Text>
          <Plot figure={found.figure} label={`${title}. ${props.shows} Its numbers can be shown below.`} />
          <NumbersTable title={title} table={found.table} />
        </>
      )}
    </Stack>
  );
}
