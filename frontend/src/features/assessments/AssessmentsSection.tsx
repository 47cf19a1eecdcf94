import { Button, Group, List, Skeleton, Stack, Text, Title } from "@mantine/core";
import { IconChartLine, IconPlus } from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import { useState } from "react";
import { type Assessment, api, type Schemas } from "../../lib/api/client";
import { formatMoment } from "../../lib/format";
import { usePagedQuery } from "../../lib/usePagedQuery";
import { LoadMoreButton } from "../../ui/LoadMoreButton";
import { ButtonLink } from "../../ui/links";
import { ProblemNote } from "../../ui/ProblemNote";
import { useMay } from "../auth/hooks";
import { AssessmentForm } from "./AssessmentForm";
import { AssessmentTable } from "./AssessmentTable";
import type { Side } from "./draft";
import { painWords, romWords, spadiWords } from "./findings";
import { ASSESSMENTS } from "./messages";

/** Where the shoulder stands, against where it stood at first; enter, change and withdraw assessments. */
export function AssessmentsSection({ patientId }: { patientId: string }) {
  const patient = useQuery({ queryKey: ["patient", patientId], queryFn: () => api.patient(patientId) });
  const episodeId = patient.data?.episode_id;
  const affected = patient.data?.affected_side;
  if (!episodeId || !affected) return null;
  return <Section key={episodeId} patientId={patientId} episodeId={episodeId} affected={affected} />;
}

function Section(props: { patientId: string; episodeId: string; affected: Side }) {
  const { patientId, episodeId, affected } = props;
  const writes = useMay("write_records");
  const [editing, setEditing] = useState<Assessment | "new" | null>(null);
  const [listed, setListed] = useState(false);
  const form = useQuery({
    queryKey: ["assessment-form"],
    queryFn: api.assessmentForm,
    staleTime: Number.POSITIVE_INFINITY,
  });
  const assessments = usePagedQuery(["assessments", episodeId], (after) => api.assessments(episodeId, after));
  const found = assessments.items;
  const baseline = assessments.data?.pages[0]?.baseline ?? null;
  const newest = found?.find((one) => !one.withdrawn_at) ?? null;
  return (
    <Stack gap="xs" component="section" aria-label={ASSESSMENTS.title}>
      <Group justify="space-between">
        <Title order={2} size="h3">
          {ASSESSMENTS.title}
        </Title>
        <Group>
          <ButtonLink
            variant="default"
            to="/episodes/$episodeId/progress"
            params={{ episodeId }}
            search={{ patient: patientId }}
            leftSection={<IconChartLine size={20} />}
          >
            {ASSESSMENTS.progress}
          </ButtonLink>
          {writes && editing !== "new" && (
            <Button
              leftSection={<IconPlus size={20} />}
              disabled={!form.data}
              onClick={() => setEditing("new")}
            >
              {ASSESSMENTS.add}
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
      {found && !newest && !editing && <Text>{ASSESSMENTS.none}</Text>}
      {found && newest && form.data && (
        <Newest one={newest} baseline={baseline} form={form.data} affected={affected} />
      )}
      {found && found.length > 0 && (
        <>
          <Group>
            <Button variant="default" aria-expanded={listed} onClick={() => setListed(!listed)}>
              {listed ? ASSESSMENTS.hide : ASSESSMENTS.all}
            </Button>
          </Group>
          {listed && <AssessmentTable episodeId={episodeId} items={found} onEdit={setEditing} />}
          {listed && <LoadMoreButton list={assessments} />}
        </>
      )}
    </Stack>
  );
}

/** In words, and what has changed since the first one. */
function Newest(props: {
  one: Assessment;
  baseline: Assessment | null;
  form: Schemas["AssessmentForm"];
  affected: Side;
}) {
  const { one, form, affected } = props;
  const baseline = props.baseline?.id === one.id ? null : props.baseline;
  const moment = formatMoment(one.assessed_at);
  const other = affected === "left" ? "right" : "left";
  const others = romWords(one, null, form.rom, other);
  const said = [painWords(one, baseline), spadiWords(one, baseline, form)].filter((words) => words !== null);
  return (
    <Stack gap={4} data-testid="newest-assessment">
      <Text fw={600}>
        {baseline
          ? ASSESSMENTS.foundSince(moment, one.assessed_by, formatMoment(baseline.assessed_at))
          : ASSESSMENTS.found(moment, one.assessed_by)}
      </Text>
      <List>
        {romWords(one, baseline, form.rom, affected).map((words) => (
          <List.Item key={words}>{words}</List.Item>
        ))}
        {said.map((words) => (
          <List.Item key={words}>{words}</List.Item>
        ))}
        {others.length > 0 && <List.Item>{ASSESSMENTS.otherShoulder(other, others)}</List.Item>}
      </List>
      {one.note && <Text style={{ whiteSpace: "pre-wrap" }}>{one.note}</Text>}
    </Stack>
  );
}
