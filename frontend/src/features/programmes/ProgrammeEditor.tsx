import "./catalogue";
import {
  Button,
  Group,
  Modal,
  Select,
  SimpleGrid,
  Stack,
  Switch,
  Text,
  Textarea,
  TextInput,
} from "@mantine/core";
import { useDebouncedValue } from "@mantine/hooks";
import { useMutation, useQuery } from "@tanstack/react-query";
import { type ReactNode, useState } from "react";
import { api, ProblemError, type Schemas } from "../../lib/api/client";
import { forgetDrafts, useDraft } from "../../lib/draft";
import { formatDuration } from "../../lib/format";
import { t } from "../../lib/i18n";
import { useMaxResistanceLevel, useRecordings, useSelfPacedPermitted } from "../../lib/patientQueries";
import { translateServerText } from "../../lib/serverText";
import { ProblemNote } from "../../ui/ProblemNote";
import { isWithin, Stepper, type Steps } from "../../ui/Stepper";
import { useUserName } from "../auth/hooks";
import { StageWarning } from "../patients/StageWarning";
import { arePlayable, PlaySettings } from "../station/PlaySettings";
import { ResistanceLevel } from "../station/ResistanceLevel";
import { SelfPacedChoice } from "../station/SelfPaced";
import { describeTimer, playingTimeS } from "./describeProgramme";
import { added, type Draft, type DraftItem, itemsOf, type Wanted } from "./draft";
import { EditableItems } from "./EditableItems";
import { EndRangeFields, isEndRangeValid } from "./EndRangeFields";

type Treated = { id: string; side: "left" | "right" };
type Field = Steps & { label: string; none: string; enable: string; unit: string };
const TIMER: Field = { ...t("programmes:editor.timer", { returnObjects: true }), min: 1, max: 240, step: 1 };
const WEEKLY_GOAL: Field = {
  ...t("programmes:editor.weeklyGoal", { returnObjects: true }),
  min: 1,
  max: 21,
  step: 1,
};

/** Return true if an optional number is empty or within its bounds. */
const isGiven = (field: Field, value: number | null) => value === null || isWithin(field, value);

type EditorProps = {
  patientId: string;
  /** The patient and the shoulder of the programme. */
  episode: Treated;
  start: Draft;
  /** Identifies the programme and version of the draft. */
  draftKey: string;
  saveLabel: string;
  onSave: (wanted: Wanted) => Promise<unknown>;
  onCancel: () => void;
  /** Extra fields above the others. */
  children?: (fields: Record<string, string>) => ReactNode;
};

/** An editor of a programme: recordings with settings, timer, frequency and reason. */
export function ProgrammeEditor(props: EditorProps) {
  const { patientId, episode, start } = props;
  const [draft, setDraft] = useDraft(`programme ${props.draftKey} items`, start);
  const [note, setNote] = useDraft(`programme ${props.draftKey} note`, "");
  const [name, setName] = useState(useUserName());
  const preview = usePreview(patientId, episode.id, draft);
  const save = useMutation({
    mutationFn: () => props.onSave({ ...draft, items: itemsOf(draft.items), note, made_by: name }),
    onSuccess: () => drop(),
  });
  const drop = () => forgetDrafts(`programme ${props.draftKey}`);
  const fields = save.error instanceof ProblemError ? save.error.fields : {};
  const checked = preview.result?.items ?? [];
  const timerWarning = describeTimer(draft.timer_minutes, playingTimeS(checked));
  return (
    <Stack component="section" aria-label={t("programmes:editor.title")}>
      {props.children?.(fields)}
      <RecordingsEditor
        patientId={patientId}
        episode={episode}
        draft={draft}
        checked={checked}
        onChange={setDraft}
      />
      <TotalTime draft={draft} preview={preview} />
      {timerWarning && <Text data-testid="beyond">{timerWarning}</Text>}
      <ProblemNote error={preview.error} />
      <TimerAndGoal draft={draft} onChange={setDraft} />
      <ReasonFields note={note} onNote={setNote} name={name} onName={setName} errors={fields} />
      <ProblemNote error={save.error} />
      <Group>
        <Button
          size="lg"
          loading={save.isPending}
          disabled={!isComplete(draft) || checked.some(({ problem }) => problem !== null)}
          onClick={() => save.mutate()}
        >
          {props.saveLabel}
        </Button>
        <Button
          size="lg"
          variant="default"
          onClick={() => {
            drop();
            props.onCancel();
          }}
        >
          {t("programmes:editor.discard")}
        </Button>
      </Group>
    </Stack>
  );
}

/** The recordings in order, with a dialog for an item's settings and a select that adds a recording. */
function RecordingsEditor(props: {
  patientId: string;
  episode: Treated;
  draft: Draft;
  checked: Schemas["ItemPreview"][];
  onChange: (draft: Draft) => void;
}) {
  const { patientId, episode, draft, checked, onChange } = props;
  const [editedKey, setEditedKey] = useState<string | null>(null);
  const change = (key: string, given: Partial<DraftItem>) =>
    onChange({
      ...draft,
      items: draft.items.map((item) => (item.key === key ? { ...item, ...given } : item)),
    });
  const highest = useMaxResistanceLevel(patientId, episode.id);
  const mayPace = useSelfPacedPermitted(patientId, episode.id);
  const edited = draft.items.find((item) => item.key === editedKey);
  return (
    <>
      <EditableItems draft={draft} checked={checked} onChange={onChange} onSet={setEditedKey} />
      <AddRecording
        patientId={patientId}
        episode={episode}
        draft={draft}
        highest={highest}
        onChange={onChange}
        onAdded={setEditedKey}
      />
      <ItemDialog
        item={edited}
        side={episode.side}
        highest={highest}
        mayPace={mayPace}
        warning={(item) => (
          <StageWarning
            patientId={patientId}
            episodeId={episode.id}
            settings={item}
            resistanceLevel={item.resistance_level}
          />
        )}
        problem={(item) => {
          const found = checked[draft.items.indexOf(item)];
          return found?.problem ? translateServerText(found.problem, found.problem_key) : null;
        }}
        onChange={change}
        onClose={() => setEditedKey(null)}
      />
    </>
  );
}

const isItemComplete = (item: DraftItem) =>
  arePlayable(item) && item.resistance_level !== null && isEndRangeValid(item.end_range);

/** Return true if every item and number can be saved. */
const isComplete = (draft: Draft) =>
  draft.items.length > 0 &&
  draft.items.every(isItemComplete) &&
  isGiven(TIMER, draft.timer_minutes) &&
  isGiven(WEEKLY_GOAL, draft.sessions_per_week);

/** Shows the total playing time, or the reason why it is not known yet. */
function TotalTime({ draft, preview }: { draft: Draft; preview: ReturnType<typeof usePreview> }) {
  const withoutLevel = draft.items.filter((item) => item.resistance_level === null);
  return (
    <Text size="lg" fw={600} data-testid="whole">
      {preview.result
        ? t("programmes:editor.total", { duration: formatDuration(playingTimeS(preview.result.items)) })
        : withoutLevel.length > 0
          ? t("programmes:editor.levelMissing", {
              recordings: withoutLevel.map((item) => item.recording_name),
            })
          : draft.items.length > 0 && !preview.error && t("programmes:editor.calculating")}
    </Text>
  );
}

function TimerAndGoal({ draft, onChange }: { draft: Draft; onChange: (draft: Draft) => void }) {
  return (
    <SimpleGrid cols={{ base: 1, xs: 2 }} style={{ alignItems: "start" }}>
      <OptionalNumber
        field={TIMER}
        usual={20}
        value={draft.timer_minutes}
        onChange={(timer_minutes) => onChange({ ...draft, timer_minutes })}
      />
      <OptionalNumber
        field={WEEKLY_GOAL}
        usual={3}
        value={draft.sessions_per_week}
        onChange={(sessions_per_week) => onChange({ ...draft, sessions_per_week })}
      />
    </SimpleGrid>
  );
}

function ReasonFields(props: {
  note: string;
  onNote: (note: string) => void;
  name: string;
  onName: (name: string) => void;
  errors: Record<string, string>;
}) {
  const { note, onNote, name, onName, errors } = props;
  return (
    <>
      <Textarea
        label={t("programmes:editor.reason")}
        rows={3}
        value={note}
        error={errors.note}
        onChange={(event) => onNote(event.currentTarget.value)}
      />
      <TextInput
        label={t("programmes:editor.prescribedBy")}
        required
        maw={400}
        value={name}
        error={errors.made_by}
        onChange={(event) => onName(event.currentTarget.value)}
      />
    </>
  );
}

/** Edits the playback settings and the resistance level of an item. */
function ItemDialog(props: {
  item: DraftItem | undefined;
  /** The shoulder of the programme, which the dialog covers. */
  side: Treated["side"];
  highest: number | null;
  /** True if the doctor permits that the patient sets the pace. */
  mayPace: boolean;
  warning: (item: DraftItem) => ReactNode;
  /** The reason why an item cannot be played, or null. */
  problem: (item: DraftItem) => string | null;
  onChange: (key: string, given: Partial<DraftItem>) => void;
  onClose: () => void;
}) {
  const { item, side, highest, mayPace, warning, problem, onChange, onClose } = props;
  return (
    <Modal opened={item !== undefined} onClose={onClose} title={item?.recording_name} size="xl">
      {item && (
        <Stack>
          <Text>{t(`programmes:programme.shoulder.${side}`)}</Text>
          <PlaySettings value={item} last={null} onChange={(given) => onChange(item.key, given)} />
          <SelfPacedChoice
            // A prescription stays removable after the permission was withdrawn.
            permitted={mayPace || item.self_paced}
            method={item.method}
            value={item.self_paced}
            onChange={(self_paced) => onChange(item.key, { self_paced })}
          />
          <ResistanceLevel
            value={item.resistance_level}
            last={null}
            highest={highest}
            onChange={(resistance_level) => onChange(item.key, { resistance_level })}
          />
          <EndRangeFields
            value={item.end_range}
            problem={item.end_range && problem(item)}
            onChange={(end_range) => onChange(item.key, { end_range })}
          />
          {warning(item)}
          <Button size="lg" onClick={onClose}>
            {t("programmes:editor.done")}
          </Button>
        </Stack>
      )}
    </Modal>
  );
}

/** Query the duration, and which items cannot be played, while the user edits. */
function usePreview(patientId: string, episodeId: string, draft: Draft) {
  const [settled] = useDebouncedValue(draft.items, 250);
  const items = itemsOf(settled);
  const preview = useQuery({
    queryKey: ["programme-preview", patientId, episodeId, items],
    queryFn: () => api.previewProgramme(patientId, { items, episode_id: episodeId }),
    enabled: items.length > 0 && settled.every(isItemComplete),
    staleTime: 60_000,
  });
  // An answer for other items or another order must not be used.
  return { error: preview.error, result: settled === draft.items ? preview.data : undefined };
}

function AddRecording(props: {
  patientId: string;
  episode: Treated;
  draft: Draft;
  /** The highest resistance level that the doctor allows; null without a limit. */
  highest: number | null;
  onChange: (draft: Draft) => void;
  onAdded: (key: string) => void;
}) {
  const { draft, episode, highest } = props;
  const recordings = useRecordings(props.patientId);
  const [next, setNext] = useState(1);
  const fitting = (recordings.data?.items ?? []).filter(
    (recording) => !recording.archived_at && recording.side === episode.side,
  );
  const add = (id: string | null) => {
    const recording = fitting.find((known) => known.id === id);
    if (!recording) return;
    props.onChange(added(draft, recording, `added ${next}`, highest));
    props.onAdded(`added ${next}`);
    setNext(next + 1);
  };
  if (recordings.data && fitting.length === 0) {
    return <Text>{t("programmes:editor.nothingToAdd")}</Text>;
  }
  return (
    <>
      <ProblemNote error={recordings.error} />
      <Select
        size="lg"
        maw={600}
        label={t("programmes:editor.add")}
        placeholder={t("programmes:editor.choose")}
        data={fitting.map((recording) => ({
          value: recording.id,
          label: t("programmes:editor.choice", {
            recording: recording.name,
            duration: formatDuration(recording.duration_s),
          }),
        }))}
        value={null}
        onChange={add}
      />
    </>
  );
}

/** A field for an optional number. */
function OptionalNumber(props: {
  field: Field;
  usual: number;
  value: number | null;
  onChange: (value: number | null) => void;
}) {
  const { field, value, onChange } = props;
  return (
    <Stack gap="xs">
      <Switch
        size="lg"
        label={value === null ? field.none : field.label}
        aria-label={field.enable}
        checked={value !== null}
        onChange={(event) => onChange(event.currentTarget.checked ? props.usual : null)}
      />
      {value !== null && <Stepper field={field} value={value} onChange={onChange} />}
    </Stack>
  );
}
