import { Button, Group, SegmentedControl, Select, Stack, Text, Textarea, TextInput } from "@mantine/core";
import { useMutation, useQueryClient } from "@tanstack/react-query";
import { type FormEvent, useState } from "react";
import { api, type Patient, ProblemError } from "../api/client";
import { ProblemNote } from "../shared/problem";

const SEXES = [
  { value: "unknown", label: "Not stated" },
  { value: "female", label: "Female" },
  { value: "male", label: "Male" },
  { value: "other", label: "Other" },
];

/** Sign a patient up, or change a record. What the service finds wrong stands at its field. */
export function PatientForm({ patient, onDone }: { patient?: Patient; onDone: (saved: Patient) => void }) {
  const queries = useQueryClient();
  const [values, setValues] = useState({
    clinic_number: patient?.clinic_number ?? "",
    name: patient?.name ?? "",
    kana: patient?.kana ?? "",
    birth_date: patient?.birth_date ?? "",
    sex: patient?.sex ?? "unknown",
    affected_side: patient?.affected_side ?? ("" as Patient["affected_side"] | ""),
    notes: patient?.notes ?? "",
  });
  const save = useMutation({
    mutationFn: () => {
      const body = {
        ...values,
        kana: values.kana || null,
        birth_date: values.birth_date || null,
        affected_side: values.affected_side as Patient["affected_side"],
      };
      return patient
        ? api.updatePatient(patient.id, { ...body, updated_at: patient.updated_at })
        : api.createPatient(body);
    },
    onSuccess: (saved) => {
      void queries.invalidateQueries({ queryKey: ["patients"] });
      queries.setQueryData(["patient", saved.id], saved);
      onDone(saved);
    },
  });
  const fields = save.error instanceof ProblemError ? save.error.fields : {};
  const text = (name: "clinic_number" | "name" | "kana" | "birth_date" | "notes") => ({
    value: values[name],
    error: fields[name],
    onChange: (event: { currentTarget: { value: string } }) => {
      const { value } = event.currentTarget;
      setValues((before) => ({ ...before, [name]: value }));
    },
  });
  const submit = (event: FormEvent) => {
    event.preventDefault();
    save.mutate();
  };
  return (
    <form onSubmit={submit} noValidate>
      <Stack>
        <TextInput label="Name" required data-autofocus {...text("name")} />
        <TextInput label="Reading of the name (kana)" {...text("kana")} />
        <TextInput label="Clinic number" required {...text("clinic_number")} />
        <div>
          <Text component="label" fw={500} id="affected-side">
            Shoulder that is treated
          </Text>
          <SegmentedControl
            size="md"
            fullWidth
            aria-labelledby="affected-side"
            value={values.affected_side}
            onChange={(side) => setValues({ ...values, affected_side: side as Patient["affected_side"] })}
            data={[
              { value: "left", label: "Left" },
              { value: "right", label: "Right" },
            ]}
          />
          {fields.affected_side && (
            <Text size="sm" c="grape.9">
              Choose left or right.
            </Text>
          )}
        </div>
        <Group grow align="start">
          <TextInput label="Birth date" type="date" {...text("birth_date")} />
          <Select
            label="Sex"
            data={SEXES}
            allowDeselect={false}
            value={values.sex}
            onChange={(sex) => setValues({ ...values, sex: (sex ?? "unknown") as Patient["sex"] })}
          />
        </Group>
        <Textarea label="Notes" autosize minRows={2} {...text("notes")} />
        <ProblemNote error={save.error} />
        <Group justify="end">
          <Button type="submit" loading={save.isPending}>
            {patient ? "Save" : "Sign up"}
          </Button>
        </Group>
      </Stack>
    </form>
  );
}
