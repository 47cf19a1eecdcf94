import "./catalogue";
import { Alert, Button, Card, FileInput, Group, Stack, Table, Text, Title } from "@mantine/core";
import { IconFileImport, IconInfoCircle } from "@tabler/icons-react";
import { useMutation, useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import { api, type Schemas } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { ProblemNote } from "../../ui/ProblemNote";
import { describeUnit } from "./describeSetting";

const LARGEST_FILE_BYTES = 100_000;

/** Imports a station's file after it was checked and its changes were shown. */
export function ImportSettings({ station }: { station: string }) {
  const queries = useQueryClient();
  const [file, setFile] = useState<File | null>(null);
  const preview = useMutation({
    mutationFn: async (chosen: File) => api.previewSettings(await chosen.text()),
  });
  const apply = useMutation({
    mutationFn: async (chosen: File) => api.importSettings(await chosen.text()),
    onSuccess: () => {
      setFile(null);
      preview.reset();
      return queries.invalidateQueries({ queryKey: ["station-versions", station] });
    },
  });
  const isLarge = file !== null && file.size > LARGEST_FILE_BYTES;
  const choose = (chosen: File | null) => {
    setFile(chosen);
    preview.reset();
    apply.reset();
    if (chosen && chosen.size <= LARGEST_FILE_BYTES) preview.mutate(chosen);
  };
  const changes = preview.data?.changes ?? [];
  return (
    <Card withBorder component="section" aria-label={t("commissioning:import.title")}>
      <Stack gap="sm">
        <Title order={2} size="h4">
          {t("commissioning:import.title")}
        </Title>
        <Text size="sm">{t("commissioning:import.explain")}</Text>
        <FileInput
          label={t("commissioning:import.file")}
          placeholder={t("commissioning:import.choose")}
          size="md"
          maw={420}
          accept=".toml"
          leftSection={<IconFileImport size={20} />}
          value={file}
          onChange={choose}
          error={isLarge && t("commissioning:import.tooLarge")}
        />
        <ProblemNote error={preview.error ?? apply.error} />
        {apply.isSuccess && <Text role="status">{t("commissioning:import.done")}</Text>}
        {preview.data && changes.length === 0 && <Text>{t("commissioning:import.unchanged")}</Text>}
        {preview.data && changes.length > 0 && <Changes preview={preview.data} />}
        <Group justify="end">
          <Button
            disabled={!file || changes.length === 0}
            loading={apply.isPending || preview.isPending}
            onClick={() => file && apply.mutate(file)}
          >
            {t("commissioning:import.apply")}
          </Button>
        </Group>
      </Stack>
    </Card>
  );
}

function Changes({ preview }: { preview: Schemas["SettingsPreview"] }) {
  return (
    <Stack gap="xs" data-testid="changes">
      <Text>{t("commissioning:import.changes")}</Text>
      <Table verticalSpacing={4}>
        <Table.Thead>
          <Table.Tr>
            <Table.Th>{t("commissioning:settings.field")}</Table.Th>
            <Table.Th ta="right">{t("commissioning:steps.before")}</Table.Th>
            <Table.Th ta="right">{t("commissioning:steps.after")}</Table.Th>
            <Table.Th>{t("commissioning:settings.unit")}</Table.Th>
          </Table.Tr>
        </Table.Thead>
        <Table.Tbody>
          {preview.changes.map((change) => (
            <Table.Tr key={change.name}>
              <Table.Td ff="monospace" translate="no">
                {change.name}
              </Table.Td>
              <Table.Td ta="right" translate="no">
                {change.before || "–"}
              </Table.Td>
              <Table.Td ta="right" fw={700} translate="no">
                {change.after || "–"}
              </Table.Td>
              <Table.Td>{describeUnit(change.unit)}</Table.Td>
            </Table.Tr>
          ))}
        </Table.Tbody>
      </Table>
      {preview.recommission && (
        <Alert color="grape" variant="light" icon={<IconInfoCircle />} role="alert">
          {t("commissioning:import.recommission")}
        </Alert>
      )}
    </Stack>
  );
}
