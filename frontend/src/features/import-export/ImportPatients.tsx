import { Button, FileInput, Group, List, Modal, SegmentedControl, Stack, Text } from "@mantine/core";
import { useDisclosure } from "@mantine/hooks";
import { IconFileImport } from "@tabler/icons-react";
import { useMutation, useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import { api } from "../../lib/api/client";
import { PageLink } from "../../ui/links";
import { FHIR, FILE } from "./messages";
import { Refused } from "./Refused";

type Side = "left" | "right";

/** A button and a dialog to import patients from a FHIR file. */
export function ImportPatients() {
  const [open, dialog] = useDisclosure(false);
  return (
    <>
      <Button variant="default" leftSection={<IconFileImport size={20} />} onClick={dialog.open}>
        {FHIR.open}
      </Button>
      <Modal opened={open} onClose={dialog.close} title={FHIR.title} size="lg">
        <Dialog />
      </Modal>
    </>
  );
}

function Dialog() {
  const queries = useQueryClient();
  const [file, setFile] = useState<File | null>(null);
  const [side, setSide] = useState<Side | "">("");
  const bring = useMutation({
    mutationFn: ({ resource, side }: { resource: File; side: Side }) => api.importPatients(side, resource),
    onSuccess: () => void queries.invalidateQueries({ queryKey: ["patients"] }),
  });
  return (
    <Stack>
      <Text>{FHIR.means}</Text>
      <FileInput
        label={FHIR.file}
        placeholder={FILE.choose}
        size="md"
        accept=".json,application/fhir+json,application/json"
        leftSection={<IconFileImport size={20} />}
        value={file}
        onChange={(chosen) => {
          setFile(chosen);
          bring.reset();
        }}
      />
      <SegmentedControl
        size="md"
        aria-label={FHIR.treated}
        value={side}
        onChange={(chosen) => setSide(chosen as Side)}
        data={[
          { value: "left", label: FHIR.sides.left },
          { value: "right", label: FHIR.sides.right },
        ]}
      />
      <Refused error={bring.error} />
      {bring.data && (
        <div data-testid="imported">
          <Text fw={600}>{FHIR.signedUp}</Text>
          <List>
            {bring.data.items.map((patient) => (
              <List.Item key={patient.id}>
                <PageLink to="/patients/$patientId" params={{ patientId: patient.id }}>
                  {patient.name}
                </PageLink>
                {FHIR.numbered(patient.clinic_number)}
              </List.Item>
            ))}
          </List>
          {bring.data.left_out.length > 0 && <Text>{FHIR.leftOut(bring.data.left_out)}</Text>}
        </div>
      )}
      <Group justify="end">
        <Button
          disabled={!file || side === "" || bring.isSuccess}
          loading={bring.isPending}
          onClick={() => file && side && bring.mutate({ resource: file, side })}
        >
          {FHIR.open}
        </Button>
      </Group>
    </Stack>
  );
}
