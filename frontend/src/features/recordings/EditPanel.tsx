import "./catalogue";
import { Button, Card, Group, Select, SimpleGrid, Stack, Text, TextInput } from "@mantine/core";
import { IconChartLine, IconDeviceFloppy } from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { useState } from "react";
import { api, type Edit, type Recording, type Schemas } from "../../lib/api/client";
import { formatDuration, formatMoment } from "../../lib/format";
import { t } from "../../lib/i18n";
import { useRecordings } from "../../lib/patientQueries";
import { Plot } from "../../ui/Plot";
import { ProblemNote } from "../../ui/ProblemNote";
import { isWithin, Stepper } from "../../ui/Stepper";
import { TitleWithHelp } from "../../ui/TitleWithHelp";
import { EDIT_TYPES, type EditType, type FieldName, fieldsOf, MOTORS, toEdit } from "./editFields";
import { MotorButtons } from "./MotorButtons";
import { RetouchEditor } from "./RetouchEditor";
import { isComplete } from "./retouch";
import { useRetouch } from "./useRetouch";

/**
 * Edits a recording: choose an edit, preview it, and save it as a new recording. The original stays
 * unchanged.
 */
export function EditPanel({
  recording,
  onSaved,
}: {
  recording: Recording & { ranges?: Schemas["MotorRange"][] };
  onSaved: (derived: Recording) => void;
}) {
  const [type, setType] = useState<EditType>("trim");
  const [entered, setEntered] = useState<Partial<Record<FieldName, number>>>({});
  const [motors, setMotors] = useState(MOTORS);
  const fields = fieldsOf(type, recording.duration_s, entered);
  const initial = (name: FieldName) => fields.find((field) => field.name === name)?.initial ?? 0;
  const number = (name: FieldName) => entered[name] ?? initial(name);
  const retouch = useRetouch(recording.duration_s, recording.ranges ?? []);
  const [newPart, setNewPart] = useState<string | null>(null);
  const edit = toEdit(type, number, { motors, part: retouch.part, newPart });
  const preview = useMutation({ mutationFn: (shown: Edit) => api.previewDerived(recording.id, shown) });
  // Only the previewed edit can be saved. After a change of a number, a new preview is needed.
  const previewed = JSON.stringify(preview.variables) === JSON.stringify(edit);
  const byMotor = type === "scale" || type === "isolate";
  const valid =
    (!byMotor || motors.length > 0) &&
    (type !== "retouch" || isComplete(retouch.part)) &&
    (type !== "reteach" || newPart !== null) &&
    fields.every((field) => isWithin(field, number(field.name)));
  return (
    <Card withBorder component="section" aria-label={t("recordings:edit.section")}>
      <Stack>
        <TitleWithHelp order={2} size="h3" topic={type === "retouch" ? "retouch" : undefined}>
          {t("recordings:edit.title")}
        </TitleWithHelp>
        <TypeChoice
          value={type}
          onChange={(chosen) => {
            setType(chosen);
            setEntered({});
          }}
        />
        <Text size="sm">{t(`recordings:editTypes.${type}.description`)}</Text>
        {byMotor && <MotorChoice chosen={motors} onChange={setMotors} />}
        {type === "retouch" && <RetouchEditor recording={recording} retouch={retouch} />}
        {type === "reteach" && <NewPartChoice recording={recording} chosen={newPart} onChange={setNewPart} />}
        <NumberFields
          fields={fields}
          valueOf={number}
          onChange={(name, value) => setEntered({ ...entered, [name]: value })}
        />
        <PreviewButton
          done={previewed && Boolean(preview.data)}
          loading={preview.isPending}
          disabled={!valid}
          onClick={() => preview.mutate(edit)}
        />
        {previewed && <ProblemNote error={preview.error} />}
        {previewed && preview.data && <Plot figure={preview.data} label={t("recordings:edit.figure")} />}
        <SaveEdit
          shown={previewed && Boolean(preview.data)}
          recording={recording}
          edit={edit}
          onSaved={onSaved}
        />
      </Stack>
    </Card>
  );
}

function NumberFields(props: {
  fields: ReturnType<typeof fieldsOf>;
  valueOf: (name: FieldName) => number;
  onChange: (name: FieldName, value: number) => void;
}) {
  if (props.fields.length === 0) return null;
  return (
    <SimpleGrid cols={{ base: 1, sm: 3 }}>
      {props.fields.map((field) => (
        <Stepper
          key={field.name}
          field={field}
          value={props.valueOf(field.name)}
          onChange={(value) => props.onChange(field.name, value)}
        />
      ))}
    </SimpleGrid>
  );
}

function PreviewButton(props: { done: boolean; loading: boolean; disabled: boolean; onClick: () => void }) {
  const { done, ...button } = props;
  return (
    <Group>
      <Button
        size="lg"
        variant={done ? "default" : "filled"}
        leftSection={<IconChartLine size={22} />}
        {...button}
      >
        {t("recordings:edit.preview")}
      </Button>
    </Group>
  );
}

function TypeChoice({ value, onChange }: { value: EditType; onChange: (type: EditType) => void }) {
  return (
    <Select
      size="lg"
      label={t("recordings:edit.type")}
      allowDeselect={false}
      data={EDIT_TYPES.map((type) => ({ value: type, label: t(`recordings:editTypes.${type}.label`) }))}
      value={value}
      onChange={(chosen) => {
        const type = EDIT_TYPES.find((editType) => editType === chosen);
        if (type) onChange(type);
      }}
    />
  );
}

function MotorChoice({ chosen, onChange }: { chosen: number[]; onChange: (motors: number[]) => void }) {
  const toggle = (toggled: number) =>
    onChange(MOTORS.filter((motor) => (motor === toggled) !== chosen.includes(motor)));
  return <MotorButtons label={t("recordings:edit.motors")} chosen={chosen} onPress={toggle} />;
}

/** The recording of the part that was taught again: another recording of the same shoulder, the newest first. */
function NewPartChoice(props: {
  recording: Recording;
  chosen: string | null;
  onChange: (recordingId: string | null) => void;
}) {
  const { id, patient_id, side, simulated } = props.recording;
  const recordings = useRecordings(patient_id);
  const others = recordings.data?.items.filter(
    (other) =>
      other.id !== id && other.side === side && other.simulated === simulated && other.archived_at === null,
  );
  return (
    <>
      <ProblemNote error={recordings.error} />
      {others?.length === 0 ? (
        <Text fw={600}>{t("recordings:edit.noPart")}</Text>
      ) : (
        <Select
          size="lg"
          label={t("recordings:edit.part")}
          allowDeselect={false}
          data={(others ?? []).map((other) => ({
            value: other.id,
            label: `${other.name}, ${formatDuration(other.duration_s)}, ${formatMoment(other.taught_at)}`,
          }))}
          value={props.chosen}
          onChange={props.onChange}
        />
      )}
    </>
  );
}

/** Saves the previewed edit. The typed name is kept while this part is hidden. */
function SaveEdit(props: {
  shown: boolean;
  recording: Recording;
  edit: Edit;
  onSaved: (derived: Recording) => void;
}) {
  const { recording, edit } = props;
  const [name, setName] = useState("");
  const save = useMutation({
    mutationFn: (body: Edit) => api.derive(recording.id, body),
    onSuccess: props.onSaved,
  });
  if (!props.shown) return null;
  return (
    <>
      <Group align="end">
        <TextInput
          size="lg"
          flex={1}
          label={t("recordings:edit.name")}
          placeholder={t("recordings:edit.unnamed", { recording: recording.name })}
          value={name}
          maxLength={100}
          onChange={(event) => setName(event.currentTarget.value)}
        />
        <Button
          size="lg"
          leftSection={<IconDeviceFloppy size={22} />}
          loading={save.isPending}
          onClick={() => save.mutate({ ...edit, ...(name.trim() && { name: name.trim() }) })}
        >
          {t("recordings:edit.save")}
        </Button>
      </Group>
      <ProblemNote error={save.error} />
    </>
  );
}
