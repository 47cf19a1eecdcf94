import { Button, Group, SegmentedControl, Select, Stack, Text, Textarea, TextInput } from "@mantine/core";
import { useMutation, useQueryClient } from "@tanstack/react-query";
import { type FormEvent, useState } from "react";
import { api, type Patient, ProblemError } from "../../lib/api/client";
import { today } from "../../lib/days";
import { t } from "../../lib/i18n";
import { replaceData } from "../../lib/replaceData";
import { DateField } from "../../ui/DateField";
import { ProblemNote } from "../../ui/ProblemNote";
import { useFocusMarked } from "../../ui/useFocusMarked";

const choices = (words: Record<string, string>) =>
  Object.entries(words).map(([value, label]) => ({ value, label }));

/** A form to create or change a patient. Each field shows the service's error for that field. */
export function PatientForm({ patient, onDone }: { patient?: Patient; onDone: (saved: Patient) => void }) {
  const { values, change, side, setSide, save } = usePatientValues(patient, onDone);
  const fields = save.error instanceof ProblemError ? save.error.fields : {};
  const form = useFocusMarked(save.error);
  const text = (name: "clinic_number" | "name" | "kana" | "notes") => ({
    value: values[name],
    error: fields[name],
    onChange: (event: { currentTarget: { value: string } }) => change({ [name]: event.currentTarget.value }),
  });
  const submit = (event: FormEvent) => {
    event.preventDefault();
    save.mutate();
  };
  return (
    <form ref={form} onSubmit={submit} noValidate>
      <Stack>
        <TextInput label={t("patients:form.name")} required data-autofocus {...text("name")} />
        <TextInput label={t("patients:form.kana")} {...text("kana")} />
        <TextInput label={t("patients:form.number")} required {...text("clinic_number")} />
        {!patient && <TreatedSide value={side} missing={Boolean(fields.affected_side)} onChange={setSide} />}
        <Group grow align="start">
          <DateField
            label={t("patients:form.birthDate")}
            max={today()}
            value={values.birth_date}
            error={fields.birth_date}
            onChange={(birth_date) => change({ birth_date })}
          />
          <Select
            label={t("patients:form.sex")}
            data={choices(t("patients:sexes", { returnObjects: true }))}
            allowDeselect={false}
            value={values.sex}
            onChange={(sex) => change({ sex: (sex ?? "unknown") as Patient["sex"] })}
          />
          <Select
            label={t("patients:form.dominant")}
            data={[
              { value: "", label: t("patients:form.notStated") },
              ...choices(t("patients:sides", { returnObjects: true })),
            ]}
            allowDeselect={false}
            value={values.dominant_side}
            onChange={(dominant) => change({ dominant_side: dominant ?? "" })}
          />
        </Group>
        <Textarea label={t("patients:form.notes")} autosize minRows={2} {...text("notes")} />
        <ProblemNote error={save.error} />
        <Group justify="end">
          <Button type="submit" loading={save.isPending}>
            {patient ? t("patients:form.save") : t("patients:form.register")}
          </Button>
        </Group>
      </Stack>
    </form>
  );
}

/** Return the form's values, and functions to change and save them. */
function usePatientValues(patient: Patient | undefined, onDone: (saved: Patient) => void) {
  const queries = useQueryClient();
  const [values, setValues] = useState({
    clinic_number: patient?.clinic_number ?? "",
    name: patient?.name ?? "",
    kana: patient?.kana ?? "",
    birth_date: patient?.birth_date ?? "",
    sex: patient?.sex ?? "unknown",
    dominant_side: patient?.dominant_side ?? "",
    notes: patient?.notes ?? "",
  });
  const change = (part: Partial<typeof values>) => setValues((before) => ({ ...before, ...part }));
  // The version of the shown values. A newer version may arrive during editing.
  const [version] = useState(patient?.updated_at ?? null);
  // Only for a new patient, because later the episode of care contains the side.
  const [side, setSide] = useState<"left" | "right" | "">("");
  const save = useMutation({
    mutationFn: () => {
      const body = {
        ...values,
        kana: values.kana || null,
        birth_date: values.birth_date || null,
        dominant_side: (values.dominant_side || null) as Patient["dominant_side"],
      };
      return patient
        ? api.updatePatient(patient.id, { ...body, updated_at: version })
        : api.createPatient({ ...body, affected_side: side as "left" | "right" });
    },
    onSuccess: (saved) => {
      void queries.invalidateQueries({ queryKey: ["patients"] });
      replaceData(queries, ["patient", saved.id], saved);
      onDone(saved);
    },
    onError: () => void queries.invalidateQueries({ queryKey: ["patient", patient?.id] }),
  });
  return { values, change, side, setSide, save };
}

/** The shoulder to treat. At first none is selected, so that the user must choose. */
function TreatedSide(props: {
  value: "left" | "right" | "";
  missing: boolean;
  onChange: (side: "left" | "right") => void;
}) {
  const { value, missing, onChange } = props;
  return (
    <div>
      <Text component="label" fw={500} id="affected-side">
        {t("patients:form.treated")}
      </Text>
      <SegmentedControl
        size="md"
        fullWidth
        aria-labelledby="affected-side"
        value={value}
        onChange={(chosen) => onChange(chosen as "left" | "right")}
        data={choices(t("patients:sides", { returnObjects: true }))}
      />
      {missing && (
        <Text size="sm" c="grape.9">
          {t("patients:form.chooseSide")}
        </Text>
      )}
    </div>
  );
}
