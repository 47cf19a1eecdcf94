import "./catalogue";
import { Card, Skeleton, Stack, Table, Text } from "@mantine/core";
import { type UseQueryResult, useQuery } from "@tanstack/react-query";
import { api, type Schemas } from "../../lib/api/client";
import { formatDeg, formatMoment } from "../../lib/format";
import { t } from "../../lib/i18n";
import { InlineSlot } from "../../ui/InlineSlot";
import { PageLink } from "../../ui/links";
import { Plot } from "../../ui/Plot";
import { ProblemNote } from "../../ui/ProblemNote";
import { TitleWithHelp } from "../../ui/TitleWithHelp";
import { WideTable } from "../../ui/WideTable";
import { NumbersTable } from "../progress/NumbersTable";
import { bandHead, describeRatio, describeReference, describeWhole } from "./describeRatio";
import { type Curve, curveName, describePlane, type Rhythm, rhythmFigure, rhythmTable } from "./rhythmFigure";

export function RhythmOfRecording({ recordingId }: { recordingId: string }) {
  const rhythm = useQuery({
    queryKey: ["recording-rhythm", recordingId],
    queryFn: () => api.recordingRhythm(recordingId),
  });
  return <RhythmCard rhythm={rhythm} />;
}

export function RhythmOfRun({ runId }: { runId: string }) {
  const rhythm = useQuery({ queryKey: ["run-rhythm", runId], queryFn: () => api.runRhythm(runId) });
  return <RhythmCard rhythm={rhythm} />;
}

/** Shows the scapula over the elevation of the arm: curve, ratio by phase, published ratios, and the sound side. */
function RhythmCard({ rhythm }: { rhythm: UseQueryResult<Rhythm> }) {
  return (
    <Card withBorder component="section" aria-label={t("rhythm:title")}>
      <Stack>
        <TitleWithHelp topic="rhythm" order={2} size="h3">
          {t("rhythm:title")}
        </TitleWithHelp>
        <Text>{t("rhythm:links")}</Text>
        <ProblemNote error={rhythm.error} />
        {rhythm.isPending && <Skeleton h={420} />}
        {rhythm.data && <Shown rhythm={rhythm.data} />}
      </Stack>
    </Card>
  );
}

function Shown({ rhythm }: { rhythm: Rhythm }) {
  if (rhythm.curves.length === 0) return <Text fw={600}>{t("rhythm:notRaised", ranges(rhythm))}</Text>;
  return (
    <>
      <SoundSide rhythm={rhythm} />
      <Plot figure={rhythmFigure(rhythm)} label={t("rhythm:figure")} />
      <Ratios curves={rhythm.curves} />
      <Sources curves={rhythm.curves} />
      <NumbersTable name="rhythm" title={t("rhythm:title")} table={rhythmTable(rhythm)} />
    </>
  );
}

const ranges = (rhythm: Rhythm) => ({
  from: formatDeg(rhythm.elevation_min_deg, 0),
  to: formatDeg(rhythm.elevation_max_deg, 0),
  lowest: formatDeg(rhythm.scapula_min_deg, 0),
  highest: formatDeg(rhythm.scapula_max_deg, 0),
});

/** Says whether the scapula is ahead of that of the sound side, or why this is unknown. */
function SoundSide({ rhythm }: { rhythm: Rhythm }) {
  const { sound, no_sound, leads } = rhythm;
  if (!sound) return no_sound && <Text>{t(`rhythm:noSound.${no_sound}`)}</Text>;
  return (
    <>
      <Text>
        <InlineSlot
          words={(name) => t("rhythm:compared", { recording: name, when: formatMoment(sound.taught_at) })}
        >
          <PageLink inherit to="/recordings/$recordingId" params={{ recordingId: sound.recording_id }}>
            {sound.name}
          </PageLink>
        </InlineSlot>
      </Text>
      {leads.length === 0 && <Text>{t("rhythm:noLead")}</Text>}
      {leads.map((lead) => (
        <Text key={lead.of} {...(lead.ahead_from_deg !== null && { fw: 600 })}>
          {describeLead(lead)}
        </Text>
      ))}
      {leads.length > 0 && <Text size="sm">{t("rhythm:leadMeans")}</Text>}
    </>
  );
}

function describeLead(lead: Schemas["RhythmLead"]): string {
  const numbers = {
    of: t(`rhythm:of.${lead.of}`),
    largest: formatDeg(lead.largest_deg),
    at: formatDeg(lead.at_elevation_deg, 0),
    from: formatDeg(lead.from_deg, 0),
    to: formatDeg(lead.to_deg, 0),
  };
  return lead.ahead_from_deg === null
    ? t("rhythm:notAhead", numbers)
    : t("rhythm:ahead", { ...numbers, since: formatDeg(lead.ahead_from_deg, 0) });
}

/** Shows the ratio of each phase, or why there is none. */
function Ratios({ curves }: { curves: Curve[] }) {
  const bands = curves[0]?.bands ?? [];
  return (
    <WideTable minWidth={960} caption={t("rhythm:caption")} data-testid="ratios">
      <Table.Thead>
        <Table.Tr>
          <Table.Th>{t("rhythm:heads.curve")}</Table.Th>
          <Table.Th>{t("rhythm:heads.plane")}</Table.Th>
          <Table.Th>{t("rhythm:heads.passes")}</Table.Th>
          {bands.map((band) => (
            <Table.Th key={band.from_deg}>{bandHead(band)}</Table.Th>
          ))}
          <Table.Th>{t("rhythm:heads.whole")}</Table.Th>
          <Table.Th>{t("rhythm:heads.published")}</Table.Th>
        </Table.Tr>
      </Table.Thead>
      <Table.Tbody>
        {curves.map((curve) => (
          <Table.Tr key={`${curve.of} ${curve.direction} ${curve.plane_deg}`}>
            <Table.Td>{curveName(curve, curves)}</Table.Td>
            <Table.Td>{describePlane(curve)}</Table.Td>
            <Table.Td>{curve.passes}</Table.Td>
            {curve.bands.map((band) => (
              <Table.Td key={band.from_deg}>{describeRatio(band)}</Table.Td>
            ))}
            <Table.Td>{describeWhole(curve.whole)}</Table.Td>
            <Table.Td>{describeReference(curve)}</Table.Td>
          </Table.Tr>
        ))}
      </Table.Tbody>
    </WideTable>
  );
}

/** Shows the sources of the published ratios, and the conditions of their measurement. */
function Sources({ curves }: { curves: Curve[] }) {
  const used = [...new Set(curves.flatMap(({ reference }) => (reference ? [reference.source] : [])))];
  return used.map((source) => (
    <Text key={source} size="sm">
      {t(`rhythm:sources.${source}.whole`)}
    </Text>
  ));
}
