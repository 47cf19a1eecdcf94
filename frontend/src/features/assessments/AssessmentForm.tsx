import { Button, Group, Paper, Stack, Tabs, Text, Textarea, TextInput, Title } from "@mantine/core";
import { useMutation, useQueryClient } from "@tanstack/react-query";
import { type FormEvent, useState } from "react";
import { type Assessment, api, ProblemError, type Schemas } from "../../lib/api/client";
import { forgetDrafts, useDraft } from "../../lib/draft";
import { t } from "../../lib/i18n";
import { ProblemNote } from "../../ui/ProblemNote";
import { useUserName } from "../auth/hooks";
import { angleProblem, type Draft, emptyDraft, PAIN_NAMES, type Side, toDraft, toRequest } from "./draft";
import { NumberPicker } from "./NumberPicker";
import { RomGrid } from "./RomGrid";
import { SpadiFields } from "./SpadiFields";

type Props = {
  episodeId: string;
  affected: Side;
  form: Schemas["AssessmentForm"];
  /** The assessment to change; absent for a new one. */
  assessment?: Assessment;
  /** The previous assessment, whose angles are shown in empty fields. */
  last: Assessment | null;
  onDone: () => void;
};

/** A form to enter or change an assessment. The input is kept until it is saved or discarded. */
export function AssessmentForm(props: Props) {
  const { form } = props;
  const { draft, change, save, done } = useAssessmentDraft(props);
  const fields = save.error instanceof ProblemError ? save.error.fields : {};
  const title = props.assessment ? t("assessments:form.change") : t("assessments:form.add");
  const submit = (event: FormEvent) => {
    event.preventDefault();
    save.mutate();
  };
  return (
    <Paper withBorder p="md" component="section" aria-label={title}>
      <form onSubmit={submit} noValidate>
        <Stack>
          <Title order={3} size="h4">
            {title}
          </Title>
          <WhenAndBy draft={draft} fields={fields} onChange={change} />
          <FindingsTabs
            form={form}
            affected={props.affected}
            last={props.last}
            draft={draft}
            onChange={change}
          />
          <Textarea
            label={t("assessments:form.note")}
            autosize
            minRows={2}
            value={draft.note}
            error={fields.note}
            onChange={(event) => change({ note: event.currentTarget.value })}
          />
          <ProblemNote error={save.error} />
          <Group justify="end">
            <Button variant="default" onClick={done}>
              {t("assessments:form.discard")}
            </Button>
            <Button
              type="submit"
              loading={save.isPending}
              disabled={isImplausible(draft, form.rom) || !draft.at}
            >
              {t("assessments:form.save")}
            </Button>
          </Group>
        </Stack>
      </form>
    </Paper>
  );
}

/** Return the draft of an assessment, and functions to change, save and discard it. */
function useAssessmentDraft({ episodeId, form, assessment, onDone }: Props) {
  const queries = useQueryClient();
  const userName = useUserName();
  const [key] = useState(`assessment ${assessment?.id ?? episodeId} ${assessment?.updated_at ?? ""}`);
  const [draft, setDraft] = useDraft(key, () =>
    assessment ? toDraft(assessment) : emptyDraft(new Date(), userName),
  );
  const change = (part: Partial<Draft>) => setDraft((before) => ({ ...before, ...part }));
  const done = () => {
    forgetDrafts(key);
    onDone();
  };
  const save = useMutation({
    mutationFn: () => {
      const body = toRequest(draft, form.rom);
      if (!assessment) return api.createAssessment(episodeId, body);
      // The stored time is more precise than the field. It is sent only if the user changed it.
      const { assessed_at, ...rest } = body;
      const timeChanged = draft.at !== toDraft(assessment).at;
      return api.updateAssessment(assessment.id, {
        ...rest,
        ...(timeChanged && { assessed_at }),
        updated_at: assessment.updated_at,
      });
    },
    onSuccess: () => {
      void queries.invalidateQueries({ queryKey: ["assessments", episodeId] });
      void queries.invalidateQueries({ queryKey: ["progress", episodeId] });
      done();
    },
  });
  return { draft, change, save, done };
}

/** True if an angle of the draft is not plausible. */
function isImplausible(draft: Draft, measures: Schemas["RomMeasure"][]): boolean {
  return measures.some((measure) =>
    Object.entries(draft.rom).some(
      ([angle, typed]) =>
        angle.includes(` ${measure.motion} ${measure.position} `) && angleProblem(measure, typed),
    ),
  );
}

function WhenAndBy(props: {
  draft: Draft;
  fields: Record<string, string>;
  onChange: (part: Partial<Draft>) => void;
}) {
  const { draft, fields, onChange } = props;
  return (
    <Group align="start">
      <TextInput
        label={t("assessments:form.when")}
        type="datetime-local"
        required
        value={draft.at}
        error={fields.assessed_at}
        onChange={(event) => onChange({ at: event.currentTarget.value })}
      />
      <TextInput
        label={t("assessments:form.by")}
        required
        value={draft.by}
        error={fields.assessed_by}
        onChange={(event) => onChange({ by: event.currentTarget.value })}
      />
    </Group>
  );
}

/** The range of motion, the pain and the SPADI. */
function FindingsTabs(props: {
  form: Schemas["AssessmentForm"];
  affected: Side;
  last: Assessment | null;
  draft: Draft;
  onChange: (part: Partial<Draft>) => void;
}) {
  const { form, affected, last, draft, onChange } = props;
  return (
    <Tabs defaultValue="rom" keepMounted={false}>
      <Tabs.List mb="md">
        {(
          [
            ["rom", t("assessments:form.rom")],
            ["pain", t("assessments:form.pain")],
            ["spadi", t("assessments:form.spadi")],
          ] as const
        ).map(([value, label]) => (
          <Tabs.Tab key={value} value={value} h={48} fz="md">
            {label}
          </Tabs.Tab>
        ))}
      </Tabs.List>
      <Tabs.Panel value="rom">
        <RomGrid
          measures={form.rom}
          affected={affected}
          typed={draft.rom}
          last={last}
          onChange={(rom) => onChange({ rom })}
        />
      </Tabs.Panel>
      <Tabs.Panel value="pain">
        <Stack>
          <Text size="sm">{t("assessments:form.painScale")}</Text>
          {PAIN_NAMES.map((name) => (
            <NumberPicker
              key={name}
              label={t(`assessments:pains.${name}`)}
              value={draft.pains[name]}
              onChange={(pain) => onChange({ pains: { ...draft.pains, [name]: pain } })}
            />
          ))}
        </Stack>
      </Tabs.Panel>
      <Tabs.Panel value="spadi">
        <SpadiFields items={form.spadi} answers={draft.spadi} onChange={(spadi) => onChange({ spadi })} />
      </Tabs.Panel>
    </Tabs>
  );
}
