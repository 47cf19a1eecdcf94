import { Alert, Button, Group, NumberInput, Stack, Table, Text, Textarea, TextInput } from "@mantine/core";
import { useMutation, useQueryClient } from "@tanstack/react-query";
import { type FormEvent, useState } from "react";
import { api, type Episode, ProblemError } from "../../lib/api/client";
import { forgetDrafts, useDraft } from "../../lib/draft";
import { t } from "../../lib/i18n";
import { LOAD_LEVELS } from "../station/loadLevels";
import { MOTIONS, minus, type Side } from "./messages";

type Limits = { lowest: number | null; highest: number | null };
const NO_LIMITS: Limits = { lowest: null, highest: null };

/** A form to open or change an episode of care: the diagnosis, its start and the doctor's limits. */
export function EpisodeForm(props: {
  patientId: string;
  side: Side;
  episode?: Episode;
  onDone: (saved: Episode) => void;
}) {
  const { patientId, side, episode } = props;
  const queries = useQueryClient();
  // The version of the shown values. A newer one may arrive during editing.
  const [version] = useState(episode?.updated_at ?? null);
  const [key] = useState(`episode ${episode?.id ?? `new ${patientId} ${side}`} ${version ?? ""}`);
  const [diagnosis, setDiagnosis] = useDraft(`${key} diagnosis`, episode?.diagnosis ?? "");
  const [onset, setOnset] = useDraft(`${key} onset`, episode?.onset_on ?? "");
  const [contraindications, setContraindications] = useDraft(
    `${key} contraindications`,
    episode?.contraindications ?? "",
  );
  const [limits, setLimits] = useDraft(`${key} limits`, () => byMotion(episode));
  const [level, setLevel] = useDraft<number | null>(`${key} level`, episode?.max_load_level ?? null);
  const [speed, setSpeed] = useDraft<number | null>(`${key} speed`, episode?.max_speed_deg_s ?? null);
  const [doctor, setDoctor] = useDraft(`${key} doctor`, episode?.limits_by ?? "");
  const save = useMutation({
    mutationFn: () => {
      const body = {
        diagnosis,
        onset_on: onset || null,
        contraindications,
        limits: asLimits(limits),
        max_load_level: level,
        max_speed_deg_s: speed,
        limits_by: doctor,
      };
      return episode
        ? api.updateEpisode(episode.id, { ...body, updated_at: version })
        : api.openEpisode(patientId, { ...body, side });
    },
    onSuccess: (saved) => {
      forgetDrafts(key);
      props.onDone(saved);
    },
    onError: () => void queries.invalidateQueries({ queryKey: ["episodes", patientId] }),
  });
  const fields = save.error instanceof ProblemError ? save.error.fields : {};
  const submit = (event: FormEvent) => {
    event.preventDefault();
    save.mutate();
  };
  return (
    <form onSubmit={submit} noValidate>
      <Stack>
        <TextInput
          label={t("episodes:form.diagnosis")}
          maxLength={200}
          value={diagnosis}
          error={fields.diagnosis}
          onChange={(event) => setDiagnosis(event.currentTarget.value)}
        />
        <TextInput
          type="date"
          label={t("episodes:form.onset")}
          value={onset}
          error={fields.onset_on}
          onChange={(event) => setOnset(event.currentTarget.value)}
        />
        <Textarea
          label={t("episodes:form.contraindications")}
          autosize
          minRows={2}
          value={contraindications}
          error={fields.contraindications}
          onChange={(event) => setContraindications(event.currentTarget.value)}
        />
        <Text fw={500}>{t("episodes:form.limits")}</Text>
        <Text size="sm">{t("episodes:form.limitsHint")}</Text>
        <LimitTable limits={limits} onChange={setLimits} />
        <Group grow align="start">
          <LevelField value={level} error={fields.max_load_level} onChange={setLevel} />
          <SpeedField value={speed} error={fields.max_speed_deg_s} onChange={setSpeed} />
          <TextInput
            label={t("episodes:form.doctor")}
            maxLength={100}
            value={doctor}
            error={fields.limits_by}
            onChange={(event) => setDoctor(event.currentTarget.value)}
          />
        </Group>
        {save.error && (
          // All messages, because a limit's error has no field in this form.
          <Alert color="grape" variant="light" role="alert">
            {save.error.message} {save.error instanceof ProblemError ? save.error.nextStep : ""}
          </Alert>
        )}
        <Group justify="end">
          <Button type="submit" loading={save.isPending}>
            {episode ? t("episodes:form.save") : t("episodes:form.open")}
          </Button>
        </Group>
      </Stack>
    </form>
  );
}

/** The doctor's limits of each motion, beside the apparatus' own range. */
function LimitTable(props: {
  limits: Record<number, Limits>;
  onChange: (limits: Record<number, Limits>) => void;
}) {
  const { limits, onChange } = props;
  const field = (motion: number, name: keyof Limits, label: string) => (
    <NumberInput
      size="md"
      hideControls
      suffix={t("episodes:form.deg")}
      placeholder={t("episodes:form.noLimit")}
      aria-label={label}
      value={limits[motion]?.[name] ?? ""}
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
      max={LOAD_LEVELS}
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

function asLimits(limits: Record<number, Limits>): Episode["limits"] {
  return Object.entries(limits)
    .filter(([, { lowest, highest }]) => lowest !== null || highest !== null)
    .map(([motion, { lowest, highest }]) => ({
      motion: Number(motion),
      lowest_deg: lowest,
      highest_deg: highest,
    }));
}
