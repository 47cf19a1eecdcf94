import "./catalogue";
import { Button, Code, Group, Select, Skeleton, Stack, Table, Text, TextInput, Title } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { useNavigate, useSearch } from "@tanstack/react-router";
import { useTitle } from "../../app/title";
import { type Account, api, type Schemas } from "../../lib/api/client";
import { formatClock, formatDayOf } from "../../lib/format";
import { t } from "../../lib/i18n";
import { usePagedQuery } from "../../lib/usePagedQuery";
import { LoadMoreButton } from "../../ui/LoadMoreButton";
import { PageLink } from "../../ui/links";
import { ProblemNote } from "../../ui/ProblemNote";
import { type AuditFilters, toAuditQuery } from "./auditFilters";
import { actionChoices, describeAction, describeDetail, describeSubject } from "./describeAuditEntry";
import { HeadStorage } from "./HeadStorage";

/** The audit trail, newest entry first. The address contains the filters. */
export function AuditPage() {
  useTitle(t("administration:audit.title"));
  const filters = useSearch({ from: "/administration/audit" });
  const accounts = useQuery({ queryKey: ["accounts"], queryFn: api.accounts });
  const entries = usePagedQuery(["audit", filters], (after) => api.audit(toAuditQuery(filters), after));
  const heads = entries.data?.pages[0]?.heads;
  return (
    <Stack component="section" aria-label={t("administration:audit.title")}>
      <Title order={2} size="h3">
        {t("administration:audit.title")}
      </Title>
      <Text>{t("administration:audit.description")}</Text>
      {heads && <HeadStorage heads={heads} />}
      <FilterFields filters={filters} accounts={accounts.data?.items ?? []} />
      {filters.patient_id && <Text>{t("administration:audit.onePatient")}</Text>}
      <ProblemNote error={entries.error ?? accounts.error} />
      {entries.isPending && <Skeleton h={300} />}
      {entries.items?.length === 0 && <Text>{t("administration:audit.noMatch")}</Text>}
      {entries.items && entries.items.length > 0 && (
        <Rows
          items={entries.items}
          names={new Map(accounts.data?.items.map((account) => [account.id, account.name]))}
        />
      )}
      <LoadMoreButton list={entries} />
    </Stack>
  );
}

/** The filters. Each change is written to the address. */
function FilterFields({ filters, accounts }: { filters: AuditFilters; accounts: Account[] }) {
  const navigate = useNavigate({ from: "/administration/audit" });
  const setFilter = (name: keyof AuditFilters, value: string | null) => {
    const { [name]: _, ...rest } = filters;
    void navigate({ search: value ? { ...rest, [name]: value } : rest, replace: true });
  };
  return (
    <Group align="end">
      <TextInput
        type="date"
        label={t("administration:audit.from")}
        value={filters.from ?? ""}
        onChange={(event) => setFilter("from", event.currentTarget.value)}
      />
      <TextInput
        type="date"
        label={t("administration:audit.to")}
        value={filters.to ?? ""}
        onChange={(event) => setFilter("to", event.currentTarget.value)}
      />
      <Select
        label={t("administration:audit.user")}
        placeholder={t("administration:audit.anyUser")}
        clearable
        searchable
        data={accounts.map((account) => ({ value: account.id, label: account.name }))}
        value={filters.account_id ?? null}
        onChange={(value) => setFilter("account_id", value)}
      />
      <Select
        label={t("administration:audit.outcome")}
        placeholder={t("administration:audit.any")}
        clearable
        data={Object.entries(t("administration:outcomes", { returnObjects: true })).map(([value, label]) => ({
          value,
          label,
        }))}
        value={filters.outcome ?? null}
        onChange={(value) => setFilter("outcome", value)}
      />
      <Select
        label={t("administration:audit.action")}
        placeholder={t("administration:audit.any")}
        clearable
        searchable
        data={actionChoices(filters.action)}
        value={filters.action ?? null}
        onChange={(value) => setFilter("action", value)}
      />
      {Object.keys(filters).length > 0 && (
        <Button variant="subtle" onClick={() => void navigate({ search: {}, replace: true })}>
          {t("administration:audit.showAll")}
        </Button>
      )}
    </Group>
  );
}

/** Shows the entries. `names` maps account ids to names, for failed logins. */
function Rows({ items, names }: { items: Schemas["AuditEntry"][]; names: Map<string, string> }) {
  return (
    <Table.ScrollContainer minWidth={900}>
      <Table verticalSpacing="xs">
        <Table.Thead>
          <Table.Tr>
            <Table.Th ta="right">{t("administration:audit.number")}</Table.Th>
            <Table.Th>{t("administration:audit.time")}</Table.Th>
            <Table.Th>{t("administration:audit.user")}</Table.Th>
            <Table.Th>{t("administration:audit.performed")}</Table.Th>
            <Table.Th>{t("administration:audit.subject")}</Table.Th>
            <Table.Th>{t("administration:audit.source")}</Table.Th>
          </Table.Tr>
        </Table.Thead>
        <Table.Tbody>
          {items.map((entry) => (
            <EntryRow key={entry.number} entry={entry} names={names} />
          ))}
        </Table.Tbody>
      </Table>
    </Table.ScrollContainer>
  );
}

function EntryRow({ entry, names }: { entry: Schemas["AuditEntry"]; names: Map<string, string> }) {
  return (
    <Table.Tr>
      <Table.Td ta="right">{entry.number}</Table.Td>
      <Table.Td style={{ whiteSpace: "nowrap" }}>
        {formatDayOf(entry.at)} {formatClock(new Date(entry.at))}
      </Table.Td>
      <Table.Td>
        {entry.who || t("administration:audit.notSignedIn")}
        <Text size="sm" c="dimmed">
          {roleOf(entry.role) ||
            (entry.account_id &&
              t("administration:audit.triedAs", {
                name: names.get(entry.account_id) ?? t("administration:audit.anAccount"),
              }))}
        </Text>
      </Table.Td>
      <Table.Td>
        <Text title={entry.action}>{describeAction(entry.action)}</Text>
        {entry.outcome !== "done" && <Text fw={600}>{t(`administration:outcomes.${entry.outcome}`)}</Text>}
        {describeDetail(entry).map((line) => (
          <Text key={line} size="sm" c="dimmed">
            {line}
          </Text>
        ))}
        <RawEntry entry={entry} />
      </Table.Td>
      <Table.Td>
        {entry.patient_id && (
          <PageLink to="/patients/$patientId" params={{ patientId: entry.patient_id }}>
            {t("administration:audit.patient")}
          </PageLink>
        )}
        <Text size="sm" style={{ overflowWrap: "anywhere" }}>
          {describeSubject(entry.subject)}
        </Text>
      </Table.Td>
      <Table.Td>
        {entry.station}
        <Text size="sm" c="dimmed">
          {entry.address}
        </Text>
      </Table.Td>
    </Table.Tr>
  );
}

/** The entry's raw codes and ids, in the form in which `kata audit` prints them. */
function RawEntry({ entry }: { entry: Schemas["AuditEntry"] }) {
  const { action, subject, detail } = entry;
  return (
    <details>
      <Text component="summary" size="sm" c="dimmed">
        {t("administration:audit.original")}
      </Text>
      <Code block style={{ whiteSpace: "pre-wrap", overflowWrap: "anywhere" }}>
        {JSON.stringify({ action, subject, ...detail }, null, 1)}
      </Code>
    </details>
  );
}

function roleOf(code: string): string {
  const roles: Partial<Record<string, { name: string }>> = t("auth:roles", { returnObjects: true });
  return (Object.hasOwn(roles, code) ? roles[code]?.name : undefined) ?? code;
}
