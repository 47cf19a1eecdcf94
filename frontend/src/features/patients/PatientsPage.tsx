import { Button, Group, Modal, Skeleton, Stack, Switch, Text, TextInput, Title } from "@mantine/core";
import { useDebouncedCallback } from "@mantine/hooks";
import { IconSearch, IconUserPlus } from "@tabler/icons-react";
import { useNavigate, useSearch } from "@tanstack/react-router";
import { useState } from "react";
import { useTitle } from "../../app/title";
import { api, type Patient } from "../../lib/api/client";
import { formatDay, formatSide } from "../../lib/format";
import { t } from "../../lib/i18n";
import { usePagedQuery } from "../../lib/usePagedQuery";
import { DataTable } from "../../ui/DataTable";
import { LoadMoreButton } from "../../ui/LoadMoreButton";
import { PageLink } from "../../ui/links";
import { ProblemNote } from "../../ui/ProblemNote";
import type { Column } from "../../ui/tableRows";
import { RequirePermission } from "../auth/RequirePermission";
import { ImportPatients } from "../import-export/ImportPatients";
import { OpenErasures } from "../import-export/OpenErasures";
import { PatientForm } from "./PatientForm";
import { LONGEST_SEARCH, type PatientsSearch, readPatientsSearch } from "./patientsSearch";

const SEARCH_DELAY_MS = 200;

export function PatientsPage() {
  useTitle(t("patients:patients.title"));
  const { register = false, search: words = "", archived = false } = useSearch({ from: "/patients" });
  const navigate = useNavigate({ from: "/patients" });
  const change = (changed: { [name in keyof PatientsSearch]: unknown }, replace = true) =>
    navigate({ search: (before) => readPatientsSearch({ ...before, ...changed }), replace });
  const showForm = (shown: boolean) => void change({ register: shown }, !shown);
  const patients = usePagedQuery(["patients", words, archived], (after, limit) =>
    api.patients(words, archived, after, limit),
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
            <Button leftSection={<IconUserPlus size={20} />} onClick={() => showForm(true)}>
              {t("patients:patients.add")}
            </Button>
          </Group>
        </RequirePermission>
      </Group>
      <RequirePermission permission="administer">
        <OpenErasures />
      </RequirePermission>
      <Group align="end">
        <SearchField words={words} onChange={(search) => change({ search })} />
        <Switch
          size="md"
          label={t("patients:patients.archived")}
          checked={archived}
          onChange={(event) => void change({ archived: event.currentTarget.checked })}
        />
      </Group>
      <ProblemNote error={patients.error} />
      {patients.isPending && <Skeleton h={200} />}
      {items?.length === 0 && (
        <Text>{words || archived ? t("patients:patients.noMatch") : t("patients:patients.none")}</Text>
      )}
      {items && items.length > 0 && (
        <DataTable
          name="patients"
          label={t("patients:patients.title")}
          columns={COLUMNS}
          rows={items}
          rowKey={({ id }) => id}
          rowName={({ name }) => name}
          more={patients.hasNextPage}
          fetchAll={patients.fetchAll}
        />
      )}
      <LoadMoreButton list={patients} />
      <RequirePermission permission="write_records">
        <Modal opened={register} onClose={() => showForm(false)} title={t("patients:patients.add")} size="lg">
          <PatientForm
            onDone={(saved) =>
              // Back leads to the list and not to the form again.
              void navigate({
                to: "/patients/$patientId",
                params: { patientId: saved.id },
                replace: true,
              })
            }
          />
        </Modal>
      </RequirePermission>
    </Stack>
  );
}

/** The text to search for. It is in the address after a pause in typing. */
function SearchField({ words, onChange }: { words: string; onChange: (words: string) => Promise<void> }) {
  // Null: the text of the address.
  const [typed, setTyped] = useState<string | null>(null);
  const search = useDebouncedCallback(async (given: string) => {
    await onChange(given);
    setTyped((now) => (now === given ? null : now));
  }, SEARCH_DELAY_MS);
  return (
    <TextInput
      label={t("patients:patients.search")}
      description={t("patients:patients.searchHint")}
      leftSection={<IconSearch size={18} />}
      w={460}
      maw="100%"
      maxLength={LONGEST_SEARCH}
      value={typed ?? words}
      onChange={(event) => {
        setTyped(event.currentTarget.value);
        search(event.currentTarget.value);
      }}
    />
  );
}

const COLUMNS: Column<Patient>[] = [
  {
    key: "name",
    head: t("patients:patients.name"),
    always: true,
    value: ({ name }) => name,
    // As the service sorts them: a Japanese name by its reading.
    order: ({ name, kana }) => (/^\p{Script=Latin}/u.test(name) ? name : kana || name),
    cell: ({ id, name, kana }) => (
      <>
        <PageLink to="/patients/$patientId" params={{ patientId: id }}>
          {name}
        </PageLink>
        {kana && (
          <Text size="sm" c="dimmed" lang="ja">
            {kana}
          </Text>
        )}
      </>
    ),
  },
  {
    key: "number",
    head: t("patients:patients.number"),
    value: ({ clinic_number }) => clinic_number,
    cell: ({ clinic_number }) => <span style={{ whiteSpace: "nowrap" }}>{clinic_number}</span>,
  },
  {
    key: "born",
    head: t("patients:patients.born"),
    value: ({ birth_date }) => birth_date ?? null,
    cell: ({ birth_date }) => (birth_date ? formatDay(birth_date) : "–"),
  },
  {
    key: "shoulder",
    onWide: true,
    head: t("patients:patients.shoulder"),
    value: ({ affected_side }) => (affected_side ? formatSide(affected_side) : null),
    cell: ({ affected_side }) => formatSide(affected_side),
  },
];
