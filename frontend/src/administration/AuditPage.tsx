import { Button, Code, Group, Select, Skeleton, Stack, Table, Text, TextInput, Title } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { useNavigate, useSearch } from "@tanstack/react-router";
import { api, type Schemas } from "../api/client";
import { formatDayOf } from "../shared/format";
import { PageLink } from "../shared/links";
import { More } from "../shared/More";
import { usePages } from "../shared/pages";
import { ProblemNote } from "../shared/problem";
import { useTitle } from "../shared/title";
import { type AuditFilters, asAsked, OUTCOMES } from "./auditFilters";

/** What everybody did, saw and tried in vain, newest first. What the list is narrowed to stands in the address. */
export function AuditPage() {
  useTitle("Audit trail");
  const filters = useSearch({ from: "/administration/audit" });
  const navigate = useNavigate({ from: "/administration/audit" });
  const accounts = useQuery({ queryKey: ["accounts"], queryFn: api.accounts });
  const found = usePages(["audit", filters], (after) => api.audit(asAsked(filters), after));
  const set = (name: keyof AuditFilters, value: string | null) => {
    const { [name]: _, ...others } = filters;
    void navigate({ search: value ? { ...others, [name]: value } : others, replace: true });
  };
  return (
    <Stack component="section" aria-label="Audit trail">
      <Title order={2} size="h3">
        Audit trail
      </Title>
      <Text>
        It can only be added to. Whether it is whole, “kata audit verify” tells at the computer that the
        service runs on.
      </Text>
      <Group align="end">
        <TextInput
          type="date"
          label="From"
          value={filters.from ?? ""}
          onChange={(event) => set("from", event.currentTarget.value)}
        />
        <TextInput
          type="date"
          label="To"
          value={filters.to ?? ""}
          onChange={(event) => set("to", event.currentTarget.value)}
        />
        <Select
          label="Who"
          placeholder="Anybody"
          clearable
          searchable
          data={(accounts.data?.items ?? []).map((one) => ({ value: one.id, label: one.name }))}
          value={filters.account_id ?? null}
          onChange={(value) => set("account_id", value)}
        />
        <Select
          label="Outcome"
          placeholder="Any"
          clearable
          data={Object.entries(OUTCOMES).map(([value, label]) => ({ value, label }))}
          value={filters.outcome ?? null}
          onChange={(value) => set("outcome", value)}
        />
        <TextInput
          label="Action"
          placeholder="sign_in"
          maxLength={64}
          value={filters.action ?? ""}
          onChange={(event) => set("action", event.currentTarget.value)}
        />
        {Object.keys(filters).length > 0 && (
          <Button variant="subtle" onClick={() => void navigate({ search: {}, replace: true })}>
            Show all
          </Button>
        )}
      </Group>
      {filters.patient_id && <Text>Only what concerns one patient.</Text>}
      <ProblemNote error={found.error ?? accounts.error} />
      {found.isPending && <Skeleton h={300} />}
      {found.items?.length === 0 && <Text>Nothing matches.</Text>}
      {found.items && found.items.length > 0 && (
        <Rows items={found.items} names={new Map(accounts.data?.items.map((one) => [one.id, one.name]))} />
      )}
      <More list={found} />
    </Stack>
  );
}

/** `names`: of accounts, for tries of somebody who did not get in. */
function Rows({ items, names }: { items: Schemas["AuditEntry"][]; names: Map<string, string> }) {
  return (
    <Table.ScrollContainer minWidth={900}>
      <Table verticalSpacing="xs">
        <Table.Thead>
          <Table.Tr>
            <Table.Th ta="right">No.</Table.Th>
            <Table.Th>When</Table.Th>
            <Table.Th>Who</Table.Th>
            <Table.Th>What</Table.Th>
            <Table.Th>Of</Table.Th>
            <Table.Th>From</Table.Th>
          </Table.Tr>
        </Table.Thead>
        <Table.Tbody>
          {items.map((entry) => (
            <Table.Tr key={entry.number}>
              <Table.Td ta="right">{entry.number}</Table.Td>
              <Table.Td style={{ whiteSpace: "nowrap" }}>
                {formatDayOf(entry.at)} {new Date(entry.at).toLocaleTimeString()}
              </Table.Td>
              <Table.Td>
                {entry.who || "Nobody signed in"}
                <Text size="sm" c="dimmed">
                  {entry.role ||
                    (entry.account_id && `tried as ${names.get(entry.account_id) ?? "an account"}`)}
                </Text>
              </Table.Td>
              <Table.Td>
                <Code>{entry.action}</Code>
                {entry.outcome !== "done" && <Text fw={600}>{OUTCOMES[entry.outcome]}</Text>}
                {Object.entries(entry.detail).map(([what, told]) => (
                  <Text key={what} size="sm" c="dimmed" style={{ overflowWrap: "anywhere" }}>
                    {what}: {typeof told === "string" ? told : JSON.stringify(told)}
                  </Text>
                ))}
              </Table.Td>
              <Table.Td>
                {entry.patient_id && (
                  <PageLink to="/patients/$patientId" params={{ patientId: entry.patient_id }}>
                    The patient
                  </PageLink>
                )}
                <Text size="sm" style={{ overflowWrap: "anywhere" }}>
                  {entry.subject}
                </Text>
              </Table.Td>
              <Table.Td>
                {entry.station}
                <Text size="sm" c="dimmed">
                  {entry.address}
                </Text>
              </Table.Td>
            </Table.Tr>
          ))}
        </Table.Tbody>
      </Table>
    </Table.ScrollContainer>
  );
}
