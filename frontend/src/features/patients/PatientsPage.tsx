import { Button, Group, Modal, Skeleton, Stack, Switch, Table, Text, TextInput, Title } from "@mantine/core";
import { useDebouncedValue, useDisclosure } from "@mantine/hooks";
import { IconSearch, IconUserPlus } from "@tabler/icons-react";
import { useNavigate } from "@tanstack/react-router";
import { useState } from "react";
import { useTitle } from "../../app/title";
import { api, type Patient } from "../../lib/api/client";
import { formatDay, sideWord } from "../../lib/format";
import { t } from "../../lib/i18n";
import { usePagedQuery } from "../../lib/usePagedQuery";
import { LoadMoreButton } from "../../ui/LoadMoreButton";
import { PageLink } from "../../ui/links";
import { ProblemNote } from "../../ui/ProblemNote";
import { RequirePermission } from "../auth/RequirePermission";
import { ImportPatients } from "../import-export/ImportPatients";
import { OpenErasures } from "../import-export/OpenErasures";
import { PatientForm } from "./PatientForm";

export function PatientsPage() {
  useTitle(t("patients:patients.title"));
  const navigate = useNavigate();
  const [search, setSearch] = useState("");
  const [archived, setArchived] = useState(false);
  const [words] = useDebouncedValue(search, 200);
  const [registering, form] = useDisclosure(false);
  const patients = usePagedQuery(["patients", words, archived], (after) =>
    api.patients(words, archived, after),
  );
  const { items } = patients;
  return (
    <Stack>
      <Group justify="space-between">
        <Title order={1} size="h2">
          {t("patients:patients.title")}
        </Title>
        <RequirePermission permission="write_records">
          <Group>
            <ImportPatients />
            <Button leftSection={<IconUserPlus size={20} />} onClick={form.open}>
              {t("patients:patients.add")}
            </Button>
          </Group>
        </RequirePermission>
      </Group>
      <RequirePermission permission="administer">
        <OpenErasures />
      </RequirePermission>
      <Group align="end">
        <TextInput
          label={t("patients:patients.search")}
          description={t("patients:patients.searchHint")}
          leftSection={<IconSearch size={18} />}
          w={460}
          maxLength={100}
          value={search}
          onChange={(event) => setSearch(event.currentTarget.value)}
        />
        <Switch
          size="md"
          label={t("patients:patients.archived")}
          checked={archived}
          onChange={(event) => setArchived(event.currentTarget.checked)}
        />
      </Group>
      <ProblemNote error={patients.error} />
      {patients.isPending && <Skeleton h={200} />}
      {items?.length === 0 && (
        <Text>{words || archived ? t("patients:patients.noMatch") : t("patients:patients.none")}</Text>
      )}
      {items && items.length > 0 && <PatientTable items={items} />}
      <LoadMoreButton list={patients} />
      <Modal opened={registering} onClose={form.close} title={t("patients:patients.add")} size="lg">
        <PatientForm
          onDone={(saved) => {
            form.close();
            void navigate({ to: "/patients/$patientId", params: { patientId: saved.id } });
          }}
        />
      </Modal>
    </Stack>
  );
}

function PatientTable({ items }: { items: Patient[] }) {
  return (
    <Table verticalSpacing="md" highlightOnHover>
      <Table.Thead>
        <Table.Tr>
          <Table.Th>{t("patients:patients.name")}</Table.Th>
          <Table.Th>{t("patients:patients.number")}</Table.Th>
          <Table.Th>{t("patients:patients.born")}</Table.Th>
          <Table.Th>{t("patients:patients.shoulder")}</Table.Th>
        </Table.Tr>
      </Table.Thead>
      <Table.Tbody>
        {items.map((patient) => (
          <Table.Tr key={patient.id}>
            <Table.Td>
              <PageLink to="/patients/$patientId" params={{ patientId: patient.id }}>
                {patient.name}
              </PageLink>
              {patient.kana && (
                <Text size="sm" c="dimmed" lang="ja">
                  {patient.kana}
                </Text>
              )}
            </Table.Td>
            <Table.Td>{patient.clinic_number}</Table.Td>
            <Table.Td>{patient.birth_date ? formatDay(patient.birth_date) : "–"}</Table.Td>
            <Table.Td>{sideWord(patient.affected_side)}</Table.Td>
          </Table.Tr>
        ))}
      </Table.Tbody>
    </Table>
  );
}
