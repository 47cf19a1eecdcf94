import { Button, Group, Modal, Skeleton, Stack, Switch, Table, Text, TextInput, Title } from "@mantine/core";
import { useDebouncedValue, useDisclosure } from "@mantine/hooks";
import { IconSearch, IconUserPlus } from "@tabler/icons-react";
import { keepPreviousData, useQuery } from "@tanstack/react-query";
import { useNavigate } from "@tanstack/react-router";
import { useState } from "react";
import { api } from "../api/client";
import { formatDay } from "../shared/format";
import { PageLink } from "../shared/links";
import { More } from "../shared/More";
import { ProblemNote } from "../shared/problem";
import { useTitle } from "../shared/title";
import { PatientForm } from "./PatientForm";

export function PatientsPage() {
  useTitle("Patients");
  const navigate = useNavigate();
  const [search, setSearch] = useState("");
  const [archived, setArchived] = useState(false);
  const [offset, setOffset] = useState(0);
  const [words] = useDebouncedValue(search, 200);
  const [signingUp, form] = useDisclosure(false);
  const found = useQuery({
    queryKey: ["patients", words, archived, offset],
    queryFn: () => api.patients(words, archived, offset),
    placeholderData: keepPreviousData,
  });
  const items = found.data?.items ?? [];
  return (
    <Stack>
      <Group justify="space-between">
        <Title order={2}>Patients</Title>
        <Button leftSection={<IconUserPlus size={20} />} onClick={form.open}>
          New patient
        </Button>
      </Group>
      <Group>
        <TextInput
          aria-label="Search"
          placeholder="Name, kana or clinic number"
          leftSection={<IconSearch size={18} />}
          w={360}
          value={search}
          onChange={(event) => {
            setSearch(event.currentTarget.value);
            setOffset(0);
          }}
        />
        <Switch
          size="md"
          label="Archived"
          checked={archived}
          onChange={(event) => {
            setArchived(event.currentTarget.checked);
            setOffset(0);
          }}
        />
      </Group>
      <ProblemNote error={found.error} />
      {found.isPending && <Skeleton h={200} />}
      {found.data && items.length === 0 && (
        <Text>
          {words || archived ? "Nobody matches." : "Nobody is signed up yet. Begin with “New patient”."}
        </Text>
      )}
      {items.length > 0 && (
        <Table verticalSpacing="md" highlightOnHover>
          <Table.Thead>
            <Table.Tr>
              <Table.Th>Name</Table.Th>
              <Table.Th>Clinic number</Table.Th>
              <Table.Th>Born</Table.Th>
              <Table.Th>Shoulder</Table.Th>
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
                <Table.Td>{patient.affected_side === "left" ? "Left" : "Right"}</Table.Td>
              </Table.Tr>
            ))}
          </Table.Tbody>
        </Table>
      )}
      <More total={found.data?.total ?? 0} offset={offset} onOffset={setOffset} />
      <Modal opened={signingUp} onClose={form.close} title="New patient" size="lg">
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
