import { Alert, Button, Group, NumberInput, Stack, Table, Text, Textarea, TextInput } from "@mantine/core";
import { useMutation, useQueryClient } from "@tanstack/react-query";
import { type FormEvent, useState } from "react";
import { api, type Episode, ProblemError } from "../api/client";
import { LOAD_LEVELS } from "../shared/levels";
import { MOTIONS } from "./words";

type Side = Episode["side"];
type Ends = { lowest: number | null; highest: number | null };
const FREE: Ends = { lowest: null, highest: null };

/** Open an episode of a shoulder, or change one: what is treated, since when, and what a doctor allows. */
export function EpisodeForm(props: {
  patientId: string;
  side: Side;
  episode?: Episode;
  onDone: (saved: Episode) => void;
}) {
  const { patientId, side, episode } = props;
  const queries = useQueryClient();
  // Of the record that these values are from: a newer one may arrive while somebody writes.
  const [version] = useState(episode?.updated_at ?? null);
  const [diagnosis, setDiagnosis] = useState(episode?.diagnosis ?? "");
  const [onset, setOnset] = useState(episode?.onset_on ?? "");
  const [contraindications, setContraindications] = useState(episode?.contraindications ?? "");
  const [limits, setLimits] = useState(() => byMotion(episode));
  const [level, setLevel] = useState<number | null>(episode?.max_load_level ?? null);
  const [doctor, setDoctor] = useState(episode?.limits_by ?? "");
  const save = useMutation({
    mutationFn: () => {
      const body = {
        diagnosis,
        onset_on: onset || null,
        contraindications,
        limits: asLimits(limits),
        max_load_level: level,
        limits_by: doctor,
      };
      return episode
        ? api.updateEpisode(episode.id, { ...body, updated_at: version })
        : api.openEpisode(patientId, { ...body, side });
    },
    onSuccess: props.onDone,
    onError: () => void queries.invalidateQueries({ queryKey: ["episodes", patientId] }),
  });
  const fields = save.error instanceof ProblemError ? save.error.fields : {};
  const submit = (event: FormEvent) => {
    event.preventDefault();
    save.mutate();
  };
  const end = (motion: number, name: keyof Ends, label: string) => (
    <NumberInput
      size="md"
      hideControls
      suffix=" deg"
      placeholder="Free"
      aria-label={label}
      value={limits[motion]?.[name] ?? ""}
      onChange={(given) =>
        setLimits({
          ...limits,
          [motion]: { ...(limits[motion] ?? FREE), [name]: typeof given === "number" ? given : null },
        })
      }
    />
  );
  return (
    <form onSubmit={submit} noValidate>
      <Stack>
        <TextInput
          label="Diagnosis"
          maxLength={200}
          value={diagnosis}
          error={fields.diagnosis}
          onChange={(event) => setDiagnosis(event.currentTarget.value)}
        />
        <TextInput
          type="date"
          label="Onset"
          value={onset}
          error={fields.onset_on}
          onChange={(event) => setOnset(event.currentTarget.value)}
        />
        <Textarea
          label="Contraindications"
          autosize
          minRows={2}
          value={contraindications}
          error={fields.contraindications}
          onChange={(event) => setContraindications(event.currentTarget.value)}
        />
        <Text fw={500}>What the doctor allows</Text>
        <Text size="sm">
          What goes further is refused before it is played. Without a number, the apparatus' own range holds.
        </Text>
        <Table verticalSpacing="xs">
          <Table.Thead>
            <Table.Tr>
              <Table.Th>Motion, and the apparatus' range</Table.Th>
              <Table.Th>No less than</Table.Th>
              <Table.Th>No more than</Table.Th>
            </Table.Tr>
          </Table.Thead>
          <Table.Tbody>
            {MOTIONS.map(({ motion, name, from, to }) => (
              <Table.Tr key={motion}>
                <Table.Td>
                  {motion}. {name}
                  <Text size="sm" c="dimmed">
                    {String(from).replace("-", "−")} to {to} deg
                  </Text>
                </Table.Td>
                <Table.Td>{end(motion, "lowest", `${name}: no less than`)}</Table.Td>
                <Table.Td>{end(motion, "highest", `${name}: no more than`)}</Table.Td>
              </Table.Tr>
            ))}
          </Table.Tbody>
        </Table>
        <Group grow align="start">
          <NumberInput
            size="md"
            label="Highest resistance level"
            placeholder="Any"
            min={1}
            max={LOAD_LEVELS}
            allowDecimal={false}
            value={level ?? ""}
            error={fields.max_load_level}
            onChange={(given) => setLevel(typeof given === "number" ? given : null)}
          />
          <TextInput
            label="Doctor who set the limits"
            maxLength={100}
            value={doctor}
            error={fields.limits_by}
            onChange={(event) => setDoctor(event.currentTarget.value)}
          />
        </Group>
        {save.error && (
          // All of it: a limit's own error has no field of this form to stand at.
          <Alert color="grape" variant="light" role="alert">
            {save.error.message} {save.error instanceof ProblemError ? save.error.nextStep : ""}
          </Alert>
        )}
        <Group justify="end">
          <Button type="submit" loading={save.isPending}>
            {episode ? "Save" : "Open episode"}
          </Button>
        </Group>
      </Stack>
    </form>
  );
}

function byMotion(episode: Episode | undefined): Record<number, Ends> {
  return Object.fromEntries(
    (episode?.limits ?? []).map((limit) => [
      limit.motion,
      { lowest: limit.lowest_deg ?? null, highest: limit.highest_deg ?? null },
    ]),
  );
}

function asLimits(limits: Record<number, Ends>): Episode["limits"] {
  return Object.entries(limits)
    .filter(([, ends]) => ends.lowest !== null || ends.highest !== null)
    .map(([motion, ends]) => ({
      motion: Number(motion),
      lowest_deg: ends.lowest,
      highest_deg: ends.highest,
    }));
}
