import { Button, Group, Modal, Stack, Text, Title } from "@mantine/core";
import { useDisclosure } from "@mantine/hooks";
import { IconDownload, IconFileImport } from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import { useNavigate } from "@tanstack/react-router";
import { useMay } from "../access/hooks";
import { api } from "../api/client";
import { ErasureRequests } from "./ErasureRequests";
import { ImportMotion } from "./ImportMotion";

/** What leaves and enters a patient's record as files, and the patient's right to have it erased. */
export function DataSection({ patientId }: { patientId: string }) {
  const writes = useMay("write_records");
  const navigate = useNavigate();
  const [importing, dialog] = useDisclosure(false);
  const patient = useQuery({ queryKey: ["patient", patientId], queryFn: () => api.patient(patientId) });
  if (!patient.data) return null;
  const who = patient.data;
  return (
    <Stack gap="xs" component="section" aria-label="Data">
      <Title order={2} size="h3">
        Data
      </Title>
      {who.erased_at ? (
        <Text>What told who this is was erased. What the shoulder did stays, without a person.</Text>
      ) : (
        <Group>
          <Button
            component="a"
            variant="default"
            href={`/api/patients/${patientId}/export.zip`}
            leftSection={<IconDownload size={20} />}
          >
            Everything (ZIP)
          </Button>
          <Button
            component="a"
            variant="default"
            href={`/api/patients/${patientId}/fhir`}
            leftSection={<IconDownload size={20} />}
          >
            For other systems (FHIR)
          </Button>
          {writes && !who.archived_at && (
            <Button variant="default" leftSection={<IconFileImport size={20} />} onClick={dialog.open}>
              Motion from a CSV file
            </Button>
          )}
        </Group>
      )}
      <ErasureRequests patient={who} />
      <Modal opened={importing} onClose={dialog.close} title="Motion from a CSV file" size="xl">
        <ImportMotion
          patientId={patientId}
          side={who.affected_side}
          onKept={(recordingId) => {
            dialog.close();
            void navigate({ to: "/recordings/$recordingId", params: { recordingId } });
          }}
        />
      </Modal>
    </Stack>
  );
}
