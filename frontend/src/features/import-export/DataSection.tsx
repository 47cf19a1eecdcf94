import "./catalogue";
import { Button, Group, Modal, Stack, Text, Title } from "@mantine/core";
import { useDisclosure } from "@mantine/hooks";
import { IconDownload, IconFileImport } from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import { useNavigate } from "@tanstack/react-router";
import { t } from "../../lib/i18n";
import { patientOf } from "../../lib/patientQueries";
import { useHasPermission } from "../auth/hooks";
import { ErasureRequests } from "./ErasureRequests";
import { ImportMotion } from "./ImportMotion";

/** Export and import of a patient's data, and erasure requests. */
export function DataSection({ patientId }: { patientId: string }) {
  const writes = useHasPermission("write_records");
  const navigate = useNavigate();
  const [importing, dialog] = useDisclosure(false);
  const patient = useQuery(patientOf(patientId));
  if (!patient.data) return null;
  const who = patient.data;
  return (
    <Stack gap="xl">
      <Stack gap="xs" component="section" aria-label={t("import-export:data.title")}>
        <Title order={2} size="h3">
          {t("import-export:data.title")}
        </Title>
        {who.erased_at ? (
          <Text>{t("import-export:data.erased")}</Text>
        ) : (
          <Group>
            <Button
              component="a"
              variant="default"
              href={`/api/patients/${patientId}/export.zip`}
              leftSection={<IconDownload size={20} />}
            >
              {t("import-export:data.everything")}
            </Button>
            <Button
              component="a"
              variant="default"
              href={`/api/patients/${patientId}/fhir`}
              leftSection={<IconDownload size={20} />}
            >
              {t("import-export:data.otherSystems")}
            </Button>
            {writes && !who.archived_at && (
              <Button variant="default" leftSection={<IconFileImport size={20} />} onClick={dialog.open}>
                {t("import-export:data.motion")}
              </Button>
            )}
          </Group>
        )}
      </Stack>
      <ErasureRequests patient={who} />
      <Modal opened={importing} onClose={dialog.close} title={t("import-export:data.motion")} size="xl">
        <ImportMotion
          patientId={patientId}
          side={who.affected_side}
          onSaved={(recordingId) => {
            dialog.close();
            void navigate({ to: "/recordings/$recordingId", params: { recordingId } });
          }}
        />
      </Modal>
    </Stack>
  );
}
