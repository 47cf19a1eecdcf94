import "./catalogue";
import { Button, FileInput, Group, List, Modal, SegmentedControl, Stack, Text } from "@mantine/core";
import { useDisclosure } from "@mantine/hooks";
import { IconFileImport } from "@tabler/icons-react";
import { useMutation, useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import { api } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { PageLink } from "../../ui/links";
import { Refused } from "./Refused";

type Side = "left" | "right";

/** A button and a dialog to import patients from a FHIR file. */
export function ImportPatients() {
  const [open, dialog] = useDisclosure(false);
  return (
    <>
      <Button variant="default" leftSection={<IconFileImport size={20} />} onClick={dialog.open}>
        {t("import-export:fhir.open")}
      </Button>
      <Modal opened={open} onClose={dialog.close} title={t("import-export:fhir.title")} size="lg">
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
      <Text>{t("import-export:fhir.description")}</Text>
      <FileInput
        label={t("import-export:fhir.file")}
        placeholder={t("import-export:file.choose")}
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
        aria-label={t("import-export:fhir.treated")}
        value={side}
        onChange={(chosen) => setSide(chosen as Side)}
        data={[
          { value: "left", label: t("import-export:fhir.sides.left") },
          { value: "right", label: t("import-export:fhir.sides.right") },
        ]}
      />
      <Refused error={bring.error} />
      {bring.data && (
        <div data-testid="imported">
          <Text fw={600}>{t("import-export:fhir.registered")}</Text>
          <List>
            {bring.data.items.map((patient) => (
              <List.Item key={patient.id}>
                <PageLink to="/patients/$patientId" params={{ patientId: patient.id }}>
                  {patient.name}
                </PageLink>
                {t("import-export:fhir.number", { number: patient.clinic_number })}
              </List.Item>
            ))}
          </List>
          {bring.data.left_out.length > 0 && (
            <Text>{t("import-export:fhir.ignored", { items: bring.data.left_out })}</Text>
          )}
          {bring.data.left_out_further > 0 && (
            <Text>{t("import-export:fhir.ignoredFurther", { count: bring.data.left_out_further })}</Text>
          )}
        </div>
      )}
      <Group justify="end">
        <Button
          disabled={!file || side === "" || bring.isSuccess}
          loading={bring.isPending}
          onClick={() => file && side && bring.mutate({ resource: file, side })}
        >
          {t("import-export:fhir.open")}
        </Button>
      </Group>
    </Stack>
  );
}
