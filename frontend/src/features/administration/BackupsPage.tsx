import { Alert, Badge, Button, Group, List, Skeleton, Stack, Table, Text, Title } from "@mantine/core";
import { IconCircleCheck, IconDatabaseExport, IconInfoCircle } from "@tabler/icons-react";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { useTitle } from "../../app/title";
import { api, type Schemas } from "../../lib/api/client";
import { formatMoment } from "../../lib/format";
import { replaceData } from "../../lib/replaceData";
import { ProblemNote } from "../../ui/ProblemNote";
import { BACKUPS, KEYS } from "./messages";

const LOOK_AGAIN_MS = 2_000;

/** Backups that were made, and whether each of them was restored to see that it can be. */
export function BackupsPage() {
  useTitle(BACKUPS.title);
  const queries = useQueryClient();
  const backups = useQuery({
    queryKey: ["backups"],
    queryFn: api.backups,
    refetchInterval: (query) => (query.state.data?.running ? LOOK_AGAIN_MS : false),
  });
  const make = useMutation({
    mutationFn: api.makeBackup,
    onSuccess: (told) => replaceData(queries, ["backups"], told),
  });
  const told = backups.data;
  return (
    <Stack component="section" aria-label={BACKUPS.title}>
      <Group justify="space-between">
        <Title order={2} size="h3">
          {BACKUPS.title}
        </Title>
        <Button
          leftSection={<IconDatabaseExport size={20} />}
          loading={make.isPending || told?.running === true}
          onClick={() => make.mutate()}
        >
          {BACKUPS.make}
        </Button>
      </Group>
      <ProblemNote error={backups.error ?? make.error} />
      {backups.isPending && <Skeleton h={160} />}
      {told && (
        <>
          <LastGood told={told} />
          <Where told={told} />
          {told.running && <Text role="status">{BACKUPS.making}</Text>}
          {told.items.length > 0 && <Rows items={told.items} />}
        </>
      )}
    </Stack>
  );
}

/** The one question of whoever answers for the records: what would come back, and how do we know? */
function LastGood({ told }: { told: Schemas["BackupList"] }) {
  const good = told.last_good;
  return good?.tested_at ? (
    <Alert color="indigo" variant="light" icon={<IconCircleCheck />} data-testid="last-good">
      {BACKUPS.lastGood(formatMoment(good.at), formatMoment(good.tested_at))}
    </Alert>
  ) : (
    <Alert color="grape" variant="light" icon={<IconInfoCircle />} role="alert" data-testid="last-good">
      {BACKUPS.noneGood}
    </Alert>
  );
}

function Where({ told }: { told: Schemas["BackupList"] }) {
  return (
    <List>
      <List.Item>{told.next_at ? BACKUPS.next(formatMoment(told.next_at)) : BACKUPS.never}</List.Item>
      <List.Item>{BACKUPS.folder(told.folder)}</List.Item>
      {told.same_disk && (
        <List.Item>
          <b>{BACKUPS.sameDisk}</b>
        </List.Item>
      )}
      <List.Item>
        {KEYS[told.key]}
        {told.key === "here" && BACKUPS.keyFile(told.key_file)}
      </List.Item>
    </List>
  );
}

function Rows({ items }: { items: Schemas["Backup"][] }) {
  return (
    <Table verticalSpacing="sm">
      <Table.Thead>
        <Table.Tr>
          <Table.Th>{BACKUPS.made}</Table.Th>
          <Table.Th>{BACKUPS.tried}</Table.Th>
          <Table.Th ta="right">{BACKUPS.size}</Table.Th>
          <Table.Th>{BACKUPS.file}</Table.Th>
        </Table.Tr>
      </Table.Thead>
      <Table.Tbody>
        {items.map((one) => (
          <Table.Tr key={one.id}>
            <Table.Td>
              {formatMoment(one.at)}
              <Text size="sm" c="dimmed">
                {one.kind === "nightly" ? BACKUPS.byItself : BACKUPS.askedFor}
              </Text>
            </Table.Td>
            <Table.Td>
              {triedWords(one)}
              {one.audit_rows !== null && (
                <Text size="sm" {...(one.audit_problem ? { fw: 600 } : { c: "dimmed" })}>
                  {one.audit_problem
                    ? BACKUPS.auditBroken(one.audit_problem)
                    : BACKUPS.auditWhole(one.audit_rows)}
                </Text>
              )}
            </Table.Td>
            <Table.Td ta="right">{one.problem ? "–" : sizeWords(one.bytes)}</Table.Td>
            <Table.Td>
              <Text size="sm" style={{ overflowWrap: "anywhere" }}>
                {one.file}
              </Text>
              {one.file && !one.there && (
                <Badge color="gray" tt="none">
                  {BACKUPS.gone}
                </Badge>
              )}
            </Table.Td>
          </Table.Tr>
        ))}
      </Table.Tbody>
    </Table>
  );
}

function triedWords(one: Schemas["Backup"]): string {
  if (one.problem) return BACKUPS.failed(one.problem);
  if (one.test_problem) return BACKUPS.notRestorable(one.test_problem);
  if (!one.tested_at) return BACKUPS.notTried;
  return BACKUPS.cameBack(formatMoment(one.tested_at));
}

/** 1234567 bytes as 1.2 MB. */
const sizeWords = (bytes: number): string =>
  bytes < 1_000_000 ? `${Math.ceil(bytes / 1_000)} kB` : `${(bytes / 1_000_000).toFixed(1)} MB`;
