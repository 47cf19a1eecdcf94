import {
  Button,
  Group,
  List,
  SegmentedControl,
  SimpleGrid,
  Skeleton,
  Stack,
  Table,
  Text,
  Title,
} from "@mantine/core";
import { IconChartLine, IconPlus } from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import { useState } from "react";
import type { Assessment, Schemas } from "../../lib/api/client";
import { formatMoment, formatSide } from "../../lib/format";
import { t } from "../../lib/i18n";
import { ASSESSMENT_FORM, patientOf, useAssessments } from "../../lib/patientQueries";
import { LoadMoreButton } from "../../ui/LoadMoreButton";
import { ButtonLink } from "../../ui/links";
import { ProblemNote } from "../../ui/ProblemNote";
import { ScrolledTable } from "../../ui/ScrolledTable";
import { useHasPermission } from "../auth/hooks";
import { StartPatientMode } from "../patient-mode/StartPatientMode";
import { ProgressChart } from "../progress/ProgressChart";
import { AssessmentForm } from "./AssessmentForm";
import { AssessmentTable } from "./AssessmentTable";
import {
  describePain,
  describeQuestionnaires,
  describeRom,
  describeSpadi,
  ROM_COLUMNS,
} from "./describeFindings";
import type { Side } from "./draft";

/**
 * The newest findings compared with the first ones, with actions to enter, change and withdraw assessments.
 */
export function AssessmentsSection({ patientId }: { patientId: string }) {
  const patient = useQuery(patientOf(patientId));
  const episodeId = patient.data?.episode_id;
  const affected = patient.data?.affected_side;
  if (!episodeId || !affected) return null;
  return <Section key={episodeId} episodeId={episodeId} affected={affected} />;
}

function Section({ episodeId, affected }: { episodeId: string; affected: Side }) {
  const writes = useHasPermission("write_records");
  const [editing, setEditing] = useState<Assessment | "new" | null>(null);
  const [showAll, setShowAll] = useState(false);
  const form = useQuery(ASSESSMENT_FORM);
  const assessments = useAssessments(episodeId);
  const items = assessments.items;
  const baseline = assessments.data?.pages[0]?.baseline ?? null;
  const newest = items?.find((assessment) => !assessment.withdrawn_at) ?? null;
  const all = (
    <Group>
      <Button variant="default" aria-expanded={showAll} onClick={() => setShowAll(!showAll)}>
        {showAll ? t("assessments:assessments.hide") : t("assessments:assessments.all")}
      </Button>
    </Group>
  );
  return (
    <Stack gap="xs" component="section" aria-label={t("assessments:assessments.title")}>
      <Group justify="space-between">
        <Title order={2} size="h3">
          {t("assessments:assessments.title")}
        </Title>
        <Group>
          <ButtonLink
            variant="default"
            to="/episodes/$episodeId/progress"
            params={{ episodeId }}
            leftSection={<IconChartLine size={20} />}
          >
            {t("assessments:assessments.progress")}
          </ButtonLink>
          {writes && <StartPatientMode episodeId={episodeId} />}
          {writes && editing !== "new" && (
            <Button
              leftSection={<IconPlus size={20} />}
              disabled={!form.data}
              onClick={() => setEditing("new")}
            >
              {t("assessments:assessments.add")}
            </Button>
          )}
        </Group>
      </Group>
      <ProblemNote error={form.error ?? assessments.error} />
      {assessments.isPending && <Skeleton h={80} />}
      {editing && form.data && (
        <AssessmentForm
          key={editing === "new" ? "new" : editing.id}
          episodeId={episodeId}
          affected={affected}
          form={form.data}
          last={editing === "new" ? newest : null}
          onDone={() => setEditing(null)}
          {...(editing !== "new" && { assessment: editing })}
        />
      )}
      {items && !newest && !editing && <Text>{t("assessments:assessments.none")}</Text>}
      {items && newest && form.data && (
        <SimpleGrid cols={{ base: 1, md: 2 }}>
          <Stack>
            <NewestFindings assessment={newest} baseline={baseline} form={form.data} affected={affected} />
            {all}
          </Stack>
          <History episodeId={episodeId} />
        </SimpleGrid>
      )}
      {items && items.length > 0 && (
        <>
          {!newest && all}
          {showAll && <AssessmentTable episodeId={episodeId} items={items} onEdit={setEditing} />}
          {showAll && <LoadMoreButton list={assessments} />}
        </>
      )}
    </Stack>
  );
}

/** Shows the findings over the weeks, one chart at a time, with the chart's numbers. */
function History({ episodeId }: { episodeId: string }) {
  const [chart, setChart] = useState<(typeof HISTORY)[number]>("rom");
  return (
    <Stack gap="xs">
      <SegmentedControl
        size="md"
        aria-label={t("assessments:assessments.history")}
        value={chart}
        onChange={(chosen) => setChart(chosen as typeof chart)}
        data={HISTORY.map((value) => ({ value, label: t(`progress:charts.${value}.title`) }))}
      />
      <ProgressChart key={chart} episodeId={episodeId} chart={chart} />
    </Stack>
  );
}

const HISTORY = ["rom", "pain", "spadi"] as const;

/** The newest assessment in words, with the change since the first one. */
function NewestFindings(props: {
  assessment: Assessment;
  baseline: Assessment | null;
  form: Schemas["AssessmentForm"];
  affected: Side;
}) {
  const { assessment, form, affected } = props;
  const baseline = props.baseline?.id === assessment.id ? null : props.baseline;
  const moment = formatMoment(assessment.assessed_at);
  const shoulder = t(`station:station.shoulder.${affected}`);
  const scores = [
    describePain(assessment, baseline),
    describeSpadi(assessment, baseline, form),
    ...describeQuestionnaires(assessment),
  ].filter((words) => words !== null);
  return (
    <Stack gap="xs" data-testid="newest-assessment">
      <Text fw={600}>
        {baseline
          ? t("assessments:assessments.recordedAtSince", {
              shoulder,
              moment,
              by: assessment.assessed_by,
              first: formatMoment(baseline.assessed_at),
            })
          : t("assessments:assessments.recordedAt", { shoulder, moment, by: assessment.assessed_by })}
      </Text>
      <Angles rows={describeRom(assessment, baseline, form.rom, affected)} affected={affected} />
      <List spacing={4}>
        {scores.map((words) => (
          <List.Item key={words}>{words}</List.Item>
        ))}
      </List>
      {assessment.note && <Text style={{ whiteSpace: "pre-wrap" }}>{assessment.note}</Text>}
    </Stack>
  );
}

/** Shows the angles of both shoulders. Columns without an angle are left out. */
function Angles({ rows, affected }: { rows: ReturnType<typeof describeRom>; affected: Side }) {
  const other = affected === "left" ? "right" : "left";
  const columns = ROM_COLUMNS.map((column, place) => ({ ...column, place })).filter(({ place }) =>
    rows.some(({ angles }) => angles[place]),
  );
  if (rows.length === 0) return null;
  return (
    <ScrolledTable minWidth={320}>
      <Table verticalSpacing={6} horizontalSpacing={6} aria-label={t("patients:summary.rom")}>
        <Table.Thead>
          <Table.Tr>
            <Table.Th>{t("patients:summary.motion")}</Table.Th>
            {columns.map(({ place, shoulder, kind }) => (
              <Table.Th key={place} ta="right">
                {t(`assessments:assessments.sideKind.${kind}`, {
                  side: formatSide(shoulder === "affected" ? affected : other),
                })}
              </Table.Th>
            ))}
          </Table.Tr>
        </Table.Thead>
        <Table.Tbody>
          {rows.map(({ motion, angles }) => (
            <Table.Tr key={motion}>
              <Table.Td>{motion}</Table.Td>
              {columns.map(({ place, shoulder }) => (
                <Table.Td key={place} ta="right" {...(shoulder === "affected" && { fw: 600 })}>
                  {angles[place] || "–"}
                </Table.Td>
              ))}
            </Table.Tr>
          ))}
        </Table.Tbody>
      </Table>
    </ScrolledTable>
  );
}
