import { Button, Group, Modal, Stack, Text, Textarea, TextInput } from "@mantine/core";
import { useDisclosure } from "@mantine/hooks";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import { useMay, useName } from "../access/hooks";
import { api, type Patient, type Schemas } from "../api/client";
import { formatMoment } from "../shared/format";
import { ProblemNote } from "../shared/problem";

type Erasure = Schemas["Erasure"];

/** That a patient asks for the record to be erased, and what was decided. */
export function ErasureRequests({ patient }: { patient: Patient }) {
  const writes = useMay("write_records");
  const decides = useMay("administer");
  const [asking, dialog] = useDisclosure(false);
  const [deciding, decision] = useDisclosure(false);
  const requests = useQuery({
    queryKey: ["erasures", patient.id],
    queryFn: () => api.erasures(patient.id),
  });
  const items = requests.data?.items ?? [];
  const open = items.find((request) => request.decision === null);
  return (
    <Stack gap="xs">
      <ProblemNote error={requests.error} />
      {items.map((request) => (
        <Text key={request.id} data-testid="erasure">
          {words(request)}
        </Text>
      ))}
      <Group>
        {open && decides && <Button onClick={decision.open}>Decide on the erasure</Button>}
        {open && !decides && <Text>An administrator decides on it.</Text>}
        {!open && writes && !patient.erased_at && requests.data && (
          <Button variant="default" onClick={dialog.open}>
            Patient asks for erasure
          </Button>
        )}
      </Group>
      <Modal
        opened={asking}
        onClose={dialog.close}
        title="The patient asks for the record to be erased"
        size="lg"
      >
        <Ask patient={patient} onDone={dialog.close} />
      </Modal>
      <Modal opened={deciding} onClose={decision.close} title="Decide on the erasure" size="lg">
        {open && <Decide patient={patient} request={open} onDone={decision.close} />}
      </Modal>
    </Stack>
  );
}

function words(request: Erasure): string {
  const asked = `Erasure asked for on ${formatMoment(request.asked_at)}, noted by ${request.noted_by}`;
  const why = request.reason && `: ${request.reason}`;
  if (request.decision === null) return `${asked}${why}`;
  const said = request.explanation && `: ${request.explanation}`;
  return `${asked}${why}. ${request.decision === "erased" ? "Erased" : "Refused"} by ${request.decided_by}${said}`;
}

function Ask({ patient, onDone }: { patient: Patient; onDone: () => void }) {
  const queries = useQueryClient();
  const name = useName();
  const [reason, setReason] = useState("");
  const note = useMutation({
    mutationFn: () => api.noteErasure(patient.id, { reason, noted_by: name }),
    onSuccess: () => {
      void queries.invalidateQueries({ queryKey: ["erasures"] });
      onDone();
    },
  });
  return (
    <Stack>
      <Text>This is noted. Nothing is erased before somebody has decided it.</Text>
      <Textarea
        label="How and why it was asked for"
        size="md"
        autosize
        minRows={2}
        maxLength={2000}
        value={reason}
        onChange={(event) => setReason(event.currentTarget.value)}
      />
      <ProblemNote error={note.error} />
      <Group justify="end">
        <Button disabled={reason.trim() === ""} loading={note.isPending} onClick={() => note.mutate()}>
          Note the request
        </Button>
      </Group>
    </Stack>
  );
}

function Decide({ patient, request, onDone }: { patient: Patient; request: Erasure; onDone: () => void }) {
  const queries = useQueryClient();
  const name = useName();
  const [explanation, setExplanation] = useState("");
  const [number, setNumber] = useState("");
  const decide = useMutation({
    mutationFn: (decision: "erase" | "refuse") =>
      decision === "erase"
        ? api.erasePatient(request.id, { clinic_number: number, explanation, decided_by: name })
        : api.refuseErasure(request.id, { explanation, decided_by: name }),
    onSuccess: () => {
      void queries.invalidateQueries();
      onDone();
    },
  });
  return (
    <Stack>
      <Text>{words(request)}</Text>
      <Textarea
        label="Explanation"
        description="Needed for a refusal: a duty to keep records, say. Do not name the patient."
        size="md"
        autosize
        minRows={2}
        maxLength={2000}
        value={explanation}
        onChange={(event) => setExplanation(event.currentTarget.value)}
      />
      <Group justify="end">
        <Button
          variant="default"
          disabled={explanation.trim() === ""}
          loading={decide.isPending}
          onClick={() => decide.mutate("refuse")}
        >
          Refuse, keep the record
        </Button>
      </Group>
      <Text fw={600}>
        Erasing takes away name, reading, birth date, clinic number and every note. Nothing brings them back.
        What was measured stays, without a person. Copies in backups are not touched.
      </Text>
      <TextInput
        label={`To erase, type the clinic number of ${patient.name}`}
        size="md"
        autoComplete="off"
        value={number}
        onChange={(event) => setNumber(event.currentTarget.value)}
      />
      <ProblemNote error={decide.error} />
      <Group justify="end">
        <Button
          color="grape"
          disabled={number.trim() !== patient.clinic_number}
          loading={decide.isPending}
          onClick={() => decide.mutate("erase")}
        >
          Erase for good
        </Button>
      </Group>
    </Stack>
  );
}
