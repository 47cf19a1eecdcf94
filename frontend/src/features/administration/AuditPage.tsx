import "./catalogue";
import { Button, Code, Select, SimpleGrid, Skeleton, Stack, Text, Title } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { useNavigate, useSearch } from "@tanstack/react-router";
import { useTitle } from "../../app/title";
import { type Account, api, type Schemas } from "../../lib/api/client";
import { isDay } from "../../lib/days";
import { formatClock, formatDayOf } from "../../lib/format";
import { t } from "../../lib/i18n";
import { usePagedQuery } from "../../lib/usePagedQuery";
import { DataTable } from "../../ui/DataTable";
import { DateField } from "../../ui/DateField";
import { LoadMoreButton } from "../../ui/LoadMoreButton";
import { PageLink } from "../../ui/links";
import { ProblemNote } from "../../ui/ProblemNote";
import type { Column } from "../../ui/tableRows";
import { type AuditFilters, toAuditQuery } from "./auditFilters";
import { actionChoices, describeAction, describeDetail, describeSubject } from "./describeAuditEntry";
import { HeadStorage } from "./HeadStorage";

type Entry = Schemas["AuditEntry"];

/** The audit trail, newest entry first. The address contains the filters. */
export function AuditPage() {
  useTitle(t("administration:audit.title"));
  const filters = useSearch({ from: "/administration/audit" });
  const accounts = useQuery({ queryKey: ["accounts"], queryFn: api.accounts });
  const entries = usePagedQuery(["audit", filters], (after, limit) =>
    api.audit(toAuditQuery(filters), after, limit),
  );
  const names = new Map(accounts.data?.items.map(({ id, name }) => [id, name]));
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
        <DataTable
          name="audit"
          label={t("administration:audit.title")}
          columns={[...NUMBER_AND_TIME, userColumn(names), ...ACTION_TO_SOURCE]}
          rows={entries.items}
          rowKey={({ number }) => String(number)}
          more={entries.hasNextPage}
          fetchAll={entries.fetchAll}
          dense
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
    <SimpleGrid cols={{ base: 1, xs: 2, sm: 3, lg: 5 }} spacing="sm" style={{ alignItems: "end" }}>
      {(["from", "to"] as const).map((name) => (
        <DateField
          key={name}
          label={t(`administration:audit.${name}`)}
          value={filters[name] ?? ""}
          onChange={(day) => (day === "" || isDay(day)) && setFilter(name, day)}
        />
      ))}
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
    </SimpleGrid>
  );
}

/** Maps account ids to names, for failed logins. */
type Names = Map<string, string>;

const NUMBER_AND_TIME: Column<Entry>[] = [
  {
    key: "number",
    head: t("administration:audit.number"),
    right: true,
    onWide: true,
    value: ({ number }) => number,
    cell: ({ number }) => number,
  },
  {
    key: "time",
    head: t("administration:audit.time"),
    value: ({ at }) => at,
    cell: (entry) => (
      <>
        <span style={{ whiteSpace: "nowrap" }}>{formatDayOf(entry.at)}</span>{" "}
        <span style={{ whiteSpace: "nowrap" }}>{formatClock(new Date(entry.at))}</span>
      </>
    ),
  },
];

const userColumn = (names: Names): Column<Entry> => ({
  key: "user",
  below: "time",
  head: t("administration:audit.user"),
  value: (entry) => joined([describeUser(entry), describeRole(entry, names)]),
  cell: (entry) => (
    <>
      {describeUser(entry)}
      <Text size="sm" c="dimmed">
        {describeRole(entry, names)}
      </Text>
    </>
  ),
});

const ACTION_TO_SOURCE: Column<Entry>[] = [
  {
    key: "performed",
    head: t("administration:audit.performed"),
    value: (entry) =>
      joined([describeAction(entry.action), describeOutcome(entry), ...describeDetail(entry)]),
    cell: (entry) => (
      <>
        <Text title={entry.action}>{describeAction(entry.action)}</Text>
        <Text fw={600}>{describeOutcome(entry)}</Text>
        {describeDetail(entry).map((line) => (
          <Text key={line} size="sm" c="dimmed">
            {line}
          </Text>
        ))}
        <RawEntry entry={entry} />
      </>
    ),
  },
  {
    key: "subject",
    onWide: true,
    head: t("administration:audit.subject"),
    value: ({ subject }) => describeSubject(subject) || null,
    cell: ({ patient_id, subject }) => (
      <>
        {patient_id && (
          <PageLink to="/patients/$patientId" params={{ patientId: patient_id }}>
            {t("administration:audit.patient")}
          </PageLink>
        )}
        <Text size="sm" style={{ overflowWrap: "anywhere" }}>
          {describeSubject(subject)}
        </Text>
      </>
    ),
  },
  {
    key: "source",
    onWide: true,
    head: t("administration:audit.source"),
    value: ({ station, address }) => joined([station, address]),
    cell: ({ station, address }) => (
      <>
        {station}
        <Text size="sm" c="dimmed">
          {address}
        </Text>
      </>
    ),
  },
];

const joined = (lines: (string | null)[]): string | null => lines.filter(Boolean).join("\n") || null;

const describeUser = ({ who }: Entry): string => who || t("administration:audit.notSignedIn");

/** Return the user's role; for a failed login whose account is known, that account. */
function describeRole({ role, account_id }: Entry, names: Names): string {
  const name = roleOf(role);
  if (name || !account_id) return name;
  return t("administration:audit.triedAs", {
    name: names.get(account_id) ?? t("administration:audit.anAccount"),
  });
}

/** Return the outcome in words, or null if the action was done. */
const describeOutcome = ({ outcome }: Entry): string | null =>
  outcome === "done" ? null : t(`administration:outcomes.${outcome}`);

/** The entry's raw codes and ids, in the form in which `kata audit` prints them. */
function RawEntry({ entry }: { entry: Entry }) {
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
