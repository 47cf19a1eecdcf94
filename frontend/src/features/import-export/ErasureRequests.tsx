import "./catalogue";
import { Button, Group, Modal, Stack, Text, Textarea, TextInput, Title } from "@mantine/core";
import { useDisclosure } from "@mantine/hooks";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import { api, type Patient, type Schemas } from "../../lib/api/client";
import { formatMoment } from "../../lib/format";
import { t } from "../../lib/i18n";
import { ProblemNote } from "../../ui/ProblemNote";
import { useHasPermission, useUserName } from "../auth/hooks";

type Erasure = Schemas["Erasure"];

/** A patient's erasure requests and the decisions. */
export function ErasureRequests({ patient }: { patient: Patient }) {
  const writes = useHasPermission("write_records");
  const decides = useHasPermission("administer");
  const [requesting, dialog] = useDisclosure(false);
  const [deciding, decision] = useDisclosure(false);
  const requests = useQuery({
    queryKey: ["erasures", patient.id],
    queryFn: () => api.erasures(patient.id),
  });
  const items = requests.data?.items ?? [];
  const open = items.find((request) => request.decision === null);
  const adds = !open && writes && !patient.erased_at && requests.data !== undefined;
  if (items.length === 0 && !adds) return <ProblemNote error={requests.error} />;
  return (
    <Stack gap="xs" component="section" aria-label={t("import-export:erasure.title")}>
      <Title order={2} size="h3">
        {t("import-export:erasure.title")}
      </Title>
      <ProblemNote error={requests.error} />
      {items.map((request) => (
        <Text key={request.id} data-testid="erasure">
          {describeRequest(request)}
        </Text>
      ))}
      <Group>
        {open && decides && <Button onClick={decision.open}>{t("import-export:erasure.decide")}</Button>}
        {open && !decides && <Text>{t("import-export:erasure.administratorDecides")}</Text>}
        {adds && (
          <Button variant="default" onClick={dialog.open}>
            {t("import-export:erasure.add")}
          </Button>
        )}
      </Group>
      <Modal opened={requesting} onClose={dialog.close} title={t("import-export:erasure.adding")} size="lg">
        <RequestForm patient={patient} onDone={dialog.close} />
      </Modal>
      <Modal opened={deciding} onClose={decision.close} title={t("import-export:erasure.decide")} size="lg">
        {open && <DecisionForm patient={patient} request={open} onDone={decision.close} />}
      </Modal>
    </Stack>
  );
}

function describeRequest(request: Erasure): string {
  const { decision, decided_by: by, explanation, reason } = request;
  const of = { moment: formatMoment(request.asked_at), by: request.noted_by };
  const requested = reason
    ? t("import-export:erasure.requestBecause", { ...of, reason })
    : t("import-export:erasure.request", of);
  if (decision === null) return requested;
  return explanation
    ? t(`import-export:erasure.${decision}Because`, { request: requested, by, explanation })
    : t(`import-export:erasure.${decision}`, { request: requested, by });
}

function RequestForm({ patient, onDone }: { patient: Patient; onDone: () => void }) {
  const queries = useQueryClient();
  const name = useUserName();
  const [reason, setReason] = useState("");
  const note = useMutation({
    mutationFn: () => api.requestErasure(patient.id, { reason, noted_by: name }),
    onSuccess: () => {
      void queries.invalidateQueries({ queryKey: ["erasures"] });
      onDone();
    },
  });
  return (
    <Stack>
      <Text>{t("import-export:erasure.addHint")}</Text>
      <Textarea
        label={t("import-export:erasure.how")}
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
          {t("import-export:erasure.save")}
        </Button>
      </Group>
    </Stack>
  );
}

function DecisionForm({
  patient,
  request,
  onDone,
}: {
  patient: Patient;
  request: Erasure;
  onDone: () => void;
}) {
  const queries = useQueryClient();
  const name = useUserName();
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
      <Text>{describeRequest(request)}</Text>
      <Textarea
        label={t("import-export:erasure.explanation")}
        description={t("import-export:erasure.explanationHint")}
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
          {t("import-export:erasure.refuse")}
        </Button>
      </Group>
      <Text fw={600}>{t("import-export:erasure.erasing")}</Text>
      <TextInput
        label={t("import-export:erasure.typeNumber", { name: patient.name })}
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
          {t("import-export:erasure.erase")}
        </Button>
      </Group>
    </Stack>
  );
}
