import {
  Button,
  Group,
  List,
  SegmentedControl,
  SimpleGrid,
  Skeleton,
  Stack,
  Text,
  Title,
} from "@mantine/core";
import { IconChartLine, IconPlus } from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import { useState } from "react";
import { type Assessment, api, type Schemas } from "../../lib/api/client";
import { formatMoment } from "../../lib/format";
import { t } from "../../lib/i18n";
import { useAssessments } from "../../lib/patientQueries";
import { LoadMoreButton } from "../../ui/LoadMoreButton";
import { ButtonLink } from "../../ui/links";
import { ProblemNote } from "../../ui/ProblemNote";
import { useHasPermission } from "../auth/hooks";
import { StartPatientMode } from "../patient-mode/StartPatientMode";
import { ProgressChart } from "../progress/ProgressChart";
import { AssessmentForm } from "./AssessmentForm";
import { AssessmentTable } from "./AssessmentTable";
import { describePain, describeQuestionnaires, describeRom, describeSpadi } from "./describeFindings";
import type { Side } from "./draft";

/**
 * The newest findings compared with the first ones, with actions to enter, change and withdraw assessments.
 */
export function AssessmentsSection({ patientId }: { patientId: string }) {
  const patient = useQuery({ queryKey: ["patient", patientId], queryFn: () => api.patient(patientId) });
  const episodeId = patient.data?.episode_id;
  const affected = patient.data?.affected_side;
  if (!episodeId || !affected) return null;
  return <Section key={episodeId} patientId={patientId} episodeId={episodeId} affected={affected} />;
}

function Section(props: { patientId: string; episodeId: string; affected: Side }) {
  const { patientId, episodeId, affected } = props;
  const writes = useHasPermission("write_records");
  const [editing, setEditing] = useState<Assessment | "new" | null>(null);
  const [showAll, setShowAll] = useState(false);
  const form = useQuery({
    queryKey: ["assessment-form"],
    queryFn: api.assessmentForm,
    staleTime: Number.POSITIVE_INFINITY,
  });
  const assessments = useAssessments(episodeId);
  const items = assessments.items;
  const baseline = assessments.data?.pages[0]?.baseline ?? null;
  const newest = items?.find((assessment) => !assessment.withdrawn_at) ?? null;
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
            search={{ patient: patientId }}
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
          <NewestFindings assessment={newest} baseline={baseline} form={form.data} affected={affected} />
          <History episodeId={episodeId} />
        </SimpleGrid>
      )}
      {items && items.length > 0 && (
        <>
          <Group>
            <Button variant="default" aria-expanded={showAll} onClick={() => setShowAll(!showAll)}>
              {showAll ? t("assessments:assessments.hide") : t("assessments:assessments.all")}
            </Button>
          </Group>
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
  const otherSide = affected === "left" ? "right" : "left";
  const otherFindings = describeRom(assessment, null, form.rom, otherSide);
  const scores = [
    describePain(assessment, baseline),
    describeSpadi(assessment, baseline, form),
    ...describeQuestionnaires(assessment),
  ].filter((words) => words !== null);
  return (
    <Stack gap={4} data-testid="newest-assessment">
      <Text fw={600}>
        {baseline
          ? t("assessments:assessments.recordedAtSince", {
              moment,
              by: assessment.assessed_by,
              first: formatMoment(baseline.assessed_at),
            })
          : t("assessments:assessments.recordedAt", { moment, by: assessment.assessed_by })}
      </Text>
      <List>
        {describeRom(assessment, baseline, form.rom, affected).map((words) => (
          <List.Item key={words}>{words}</List.Item>
        ))}
        {scores.map((words) => (
          <List.Item key={words}>{words}</List.Item>
        ))}
        {otherFindings.length > 0 && (
          <List.Item>
            {t(`assessments:assessments.otherShoulder.${otherSide}`, {
              findings: otherFindings.join(t("common:format.separator")),
            })}
          </List.Item>
        )}
      </List>
      {assessment.note && <Text style={{ whiteSpace: "pre-wrap" }}>{assessment.note}</Text>}
    </Stack>
  );
}
