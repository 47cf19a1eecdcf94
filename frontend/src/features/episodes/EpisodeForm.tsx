import {
  Button,
  Checkbox,
  Group,
  NumberInput,
  Select,
  Stack,
  Table,
  Text,
  Textarea,
  TextInput,
} from "@mantine/core";
import { useMutation, useQueryClient } from "@tanstack/react-query";
import { type FormEvent, useState } from "react";
import { api, type Episode, ProblemError } from "../../lib/api/client";
import { today } from "../../lib/days";
import { forgetDrafts, useDraft } from "../../lib/draft";
import { t } from "../../lib/i18n";
import { DateField } from "../../ui/DateField";
import { ProblemNote } from "../../ui/ProblemNote";
import { useFocusMarked } from "../../ui/useFocusMarked";
import { RESISTANCE_LEVELS } from "../station/resistanceLevels";
import { CERTAINTIES, DIAGNOSES, MOTIONS, minus, type Side } from "./messages";

type Limits = { lowest: number | null; highest: number | null };
type LimitErrors = Record<number, { lowest?: string | undefined; highest?: string | undefined }>;
const NO_LIMITS: Limits = { lowest: null, highest: null };

type Props = {
  patientId: string;
  side: Side;
  episode?: Episode;
  onDone: (saved: Episode) => void;
};

/** A form to open or change an episode of care: the diagnosis, its start and the doctor's limits. */
export function EpisodeForm(props: Props) {
  const { draft, change, save } = useEpisodeDraft(props);
  const problem = save.error instanceof ProblemError ? save.error : null;
  const fields = problem?.fields ?? {};
  const form = useFocusMarked(save.error);
  const submit = (event: FormEvent) => {
    event.preventDefault();
    save.mutate(asLimits(draft.limits));
  };
  return (
    <form ref={form} onSubmit={submit} noValidate>
      <Stack>
        <TextInput
          label={t("episodes:form.diagnosis")}
          maxLength={200}
          value={draft.diagnosis}
          error={fields.diagnosis}
          onChange={(event) => change({ diagnosis: event.currentTarget.value })}
        />
        <DiagnosisFields
          code={draft.diagnosis_code}
          certainty={draft.verification}
          onCode={(diagnosis_code) => change({ diagnosis_code })}
          onCertainty={(verification) => change({ verification })}
        />
        <DateField
          label={t("episodes:form.onset")}
          max={today()}
          value={draft.onset_on}
          error={fields.onset_on}
          onChange={(onset_on) => change({ onset_on })}
        />
        <Textarea
          label={t("episodes:form.contraindications")}
          autosize
          minRows={2}
          value={draft.contraindications}
          error={fields.contraindications}
          onChange={(event) => change({ contraindications: event.currentTarget.value })}
        />
        <LimitFields
          draft={draft}
          fields={fields}
          limitErrors={errorsByMotion(problem, save.variables ?? [])}
          onChange={change}
        />
        <ProblemNote error={save.error} />
        <Group justify="end">
          <Button type="submit" loading={save.isPending}>
            {props.episode ? t("episodes:form.save") : t("episodes:form.open")}
          </Button>
        </Group>
      </Stack>
    </form>
  );
}

/** The fields during input. Empty numbers are null. */
type Draft = {
  diagnosis: string;
  diagnosis_code: Episode["diagnosis_code"];
  verification: Episode["verification"];
  onset_on: string;
  contraindications: string;
  limits: ReturnType<typeof byMotion>;
  max_resistance_level: number | null;
  max_speed_deg_s: number | null;
  self_paced_permitted: boolean;
  limits_by: string;
};

const toDraft = (episode: Episode | undefined): Draft => ({
  diagnosis: episode?.diagnosis ?? "",
  diagnosis_code: episode?.diagnosis_code ?? "",
  verification: episode?.verification ?? "",
  onset_on: episode?.onset_on ?? "",
  contraindications: episode?.contraindications ?? "",
  limits: byMotion(episode),
  max_resistance_level: episode?.max_resistance_level ?? null,
  max_speed_deg_s: episode?.max_speed_deg_s ?? null,
  self_paced_permitted: episode?.self_paced_permitted ?? false,
  limits_by: episode?.limits_by ?? "",
});

/** Return the draft of an episode, which is kept when its dialog closes, and functions to change and save it. */
function useEpisodeDraft({ patientId, side, episode, onDone }: Props) {
  const queries = useQueryClient();
  // The version of the shown values. A newer version may arrive during editing.
  const [version] = useState(episode?.updated_at ?? null);
  const [key] = useState(`episode ${episode?.id ?? `new ${patientId} ${side}`} ${version ?? ""}`);
  const [draft, setDraft] = useDraft(key, () => toDraft(episode));
  const change = (part: Partial<Draft>) => setDraft((before) => ({ ...before, ...part }));
  const save = useMutation({
    // The sent limits are the mutation's variables, because the service counts them in its errors.
    mutationFn: (limits: Episode["limits"]) => {
      const body = { ...draft, onset_on: draft.onset_on || null, limits };
      return episode
        ? api.updateEpisode(episode.id, { ...body, updated_at: version })
        : api.openEpisode(patientId, { ...body, side });
    },
    onSuccess: (saved) => {
      forgetDrafts(key);
      onDone(saved);
    },
    onError: () => void queries.invalidateQueries({ queryKey: ["episodes", patientId] }),
  });
  return { draft, change, save };
}

/** The doctor's limits: the range of each motion, the resistance and the speed. */
function LimitFields(props: {
  draft: Draft;
  fields: Record<string, string>;
  limitErrors: LimitErrors;
  onChange: (part: Partial<Draft>) => void;
}) {
  const { draft, fields, limitErrors, onChange } = props;
  return (
    <>
      <Text fw={500}>{t("episodes:form.limits")}</Text>
      <Text size="sm">{t("episodes:form.limitsHint")}</Text>
      <LimitTable limits={draft.limits} errors={limitErrors} onChange={(limits) => onChange({ limits })} />
      <Group grow align="start">
        <LevelField
          value={draft.max_resistance_level}
          error={fields.max_resistance_level}
          onChange={(max_resistance_level) => onChange({ max_resistance_level })}
        />
        <SpeedField
          value={draft.max_speed_deg_s}
          error={fields.max_speed_deg_s}
          onChange={(max_speed_deg_s) => onChange({ max_speed_deg_s })}
        />
        <TextInput
          label={t("episodes:form.doctor")}
          maxLength={100}
          value={draft.limits_by}
          error={fields.limits_by}
          onChange={(event) => onChange({ limits_by: event.currentTarget.value })}
        />
      </Group>
      <Checkbox
        label={t("episodes:form.selfPaced")}
        description={t("episodes:form.selfPacedHint")}
        checked={draft.self_paced_permitted}
        error={fields.self_paced_permitted}
        onChange={(event) => onChange({ self_paced_permitted: event.currentTarget.checked })}
      />
    </>
  );
}

/** The diagnosis from the short list and its certainty. The clinician chooses both. */
function DiagnosisFields(props: {
  code: Episode["diagnosis_code"];
  certainty: Episode["verification"];
  onCode: (code: Episode["diagnosis_code"]) => void;
  onCertainty: (certainty: Episode["verification"]) => void;
}) {
  return (
    <Group grow align="start">
      <Select
        label={t("episodes:form.diagnosisCode")}
        description={t("episodes:form.diagnosisCodeHint")}
        data={[{ value: "", label: t("episodes:form.notChosen") }, ...DIAGNOSES]}
        allowDeselect={false}
        value={props.code}
        onChange={(code) => props.onCode((code ?? "") as Episode["diagnosis_code"])}
      />
      <Select
        label={t("episodes:form.certainty")}
        description={t("episodes:form.certaintyHint")}
        data={[{ value: "", label: t("episodes:form.notStated") }, ...CERTAINTIES]}
        allowDeselect={false}
        value={props.certainty}
        onChange={(certainty) => props.onCertainty((certainty ?? "") as Episode["verification"])}
      />
    </Group>
  );
}

/** The doctor's limits of each motion, beside the apparatus's own range. */
function LimitTable(props: {
  limits: Record<number, Limits>;
  errors: LimitErrors;
  onChange: (limits: Record<number, Limits>) => void;
}) {
  const { limits, errors, onChange } = props;
  const field = (motion: number, name: keyof Limits, label: string) => (
    <NumberInput
      size="md"
      hideControls
      suffix={t("episodes:form.deg")}
      placeholder={t("episodes:form.noLimit")}
      aria-label={label}
      value={limits[motion]?.[name] ?? ""}
      error={errors[motion]?.[name]}
      onChange={(value) =>
        onChange({
          ...limits,
          [motion]: { ...(limits[motion] ?? NO_LIMITS), [name]: typeof value === "number" ? value : null },
        })
      }
    />
  );
  return (
    <Table verticalSpacing="xs">
      <Table.Thead>
        <Table.Tr>
          <Table.Th>{t("episodes:form.motion")}</Table.Th>
          <Table.Th>{t("episodes:form.lowest")}</Table.Th>
          <Table.Th>{t("episodes:form.highest")}</Table.Th>
        </Table.Tr>
      </Table.Thead>
      <Table.Tbody>
        {MOTIONS.map(({ motion, name, from, to }) => (
          <Table.Tr key={motion}>
            <Table.Td>
              {`${motion}. ${name}`}
              <Text size="sm" c="dimmed">
                {t("episodes:form.fromTo", { lowest: minus(from), highest: minus(to) })}
              </Text>
            </Table.Td>
            <Table.Td>{field(motion, "lowest", t("episodes:form.lowestOf", { motion: name }))}</Table.Td>
            <Table.Td>{field(motion, "highest", t("episodes:form.highestOf", { motion: name }))}</Table.Td>
          </Table.Tr>
        ))}
      </Table.Tbody>
    </Table>
  );
}

type NumberFieldProps = {
  value: number | null;
  error: string | undefined;
  onChange: (value: number | null) => void;
};

function LevelField({ value, error, onChange }: NumberFieldProps) {
  return (
    <NumberInput
      size="md"
      label={t("episodes:form.level")}
      placeholder={t("episodes:form.noLimit")}
      min={1}
      max={RESISTANCE_LEVELS}
      allowDecimal={false}
      value={value ?? ""}
      error={error}
      onChange={(input) => onChange(typeof input === "number" ? input : null)}
    />
  );
}

function SpeedField({ value, error, onChange }: NumberFieldProps) {
  return (
    <NumberInput
      size="md"
      hideControls
      label={t("episodes:form.speed")}
      description={t("episodes:form.speedHint")}
      placeholder={t("episodes:form.noLimit")}
      suffix={t("episodes:form.degPerSecond")}
      value={value ?? ""}
      error={error}
      onChange={(input) => onChange(typeof input === "number" ? input : null)}
    />
  );
}

function byMotion(episode: Episode | undefined): Record<number, Limits> {
  return Object.fromEntries(
    (episode?.limits ?? []).map((limit) => [
      limit.motion,
      { lowest: limit.lowest_deg ?? null, highest: limit.highest_deg ?? null },
    ]),
  );
}

/** Return the errors of the sent limits by motion. An error of both angles is shown at the lowest one. */
function errorsByMotion(problem: ProblemError | null, sent: Episode["limits"]): LimitErrors {
  const messages = problem?.byPointer ?? {};
  return Object.fromEntries(
    sent.map(({ motion }, place) => [
      motion,
      {
        lowest: messages[`limits/${place}/lowest_deg`] ?? messages[`limits/${place}`],
        highest: messages[`limits/${place}/highest_deg`],
      },
    ]),
  );
}

function asLimits(limits: Record<number, Limits>): Episode["limits"] {
  return Object.entries(limits)
    .filter(([, { lowest, highest }]) => lowest !== null || highest !== null)
    .map(([motion, { lowest, highest }]) => ({
      motion: Number(motion),
      lowest_deg: lowest,
      highest_deg: highest,
    }));
}
