import { Alert, Badge, Button, Group, List, Skeleton, Stack, Table, Text, Title } from "@mantine/core";
import { IconCircleCheck, IconDatabaseExport, IconInfoCircle } from "@tabler/icons-react";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { useTitle } from "../../app/title";
import { api, type Schemas } from "../../lib/api/client";
import { formatMoment } from "../../lib/format";
import { replaceData } from "../../lib/replaceData";
import { ProblemNote } from "../../ui/ProblemNote";
import { BACKUPS, KEYS } from "./messages";

const POLL_WHILE_RUNNING_MS = 2_000;

/** The backups and the results of their test restores. */
export function BackupsPage() {
  useTitle(BACKUPS.title);
  const queries = useQueryClient();
  const backups = useQuery({
    queryKey: ["backups"],
    queryFn: api.backups,
    refetchInterval: (query) => (query.state.data?.running ? POLL_WHILE_RUNNING_MS : false),
  });
  const makeBackup = useMutation({
    mutationFn: api.makeBackup,
    onSuccess: (list) => replaceData(queries, ["backups"], list),
  });
  const list = backups.data;
  return (
    <Stack component="section" aria-label={BACKUPS.title}>
      <Group justify="space-between">
        <Title order={2} size="h3">
          {BACKUPS.title}
        </Title>
        <Button
          leftSection={<IconDatabaseExport size={20} />}
          loading={makeBackup.isPending || list?.running === true}
          onClick={() => makeBackup.mutate()}
        >
          {BACKUPS.make}
        </Button>
      </Group>
      <ProblemNote error={backups.error ?? makeBackup.error} />
      {backups.isPending && <Skeleton h={160} />}
      {list && (
        <>
          <LastVerifiedBackup list={list} />
          <BackupSettings list={list} />
          {list.running && <Text role="status">{BACKUPS.making}</Text>}
          {list.items.length > 0 && <Rows items={list.items} />}
        </>
      )}
    </Stack>
  );
}

/** The newest backup that was restored successfully in a test. */
function LastVerifiedBackup({ list }: { list: Schemas["BackupList"] }) {
  const lastGood = list.last_good;
  return lastGood?.tested_at ? (
    <Alert color="indigo" variant="light" icon={<IconCircleCheck />} data-testid="last-good">
      {BACKUPS.lastGood(formatMoment(lastGood.at), formatMoment(lastGood.tested_at))}
    </Alert>
  ) : (
    <Alert color="grape" variant="light" icon={<IconInfoCircle />} role="alert" data-testid="last-good">
      {BACKUPS.noneGood}
    </Alert>
  );
}

function BackupSettings({ list }: { list: Schemas["BackupList"] }) {
  return (
    <List>
      <List.Item>{list.next_at ? BACKUPS.next(formatMoment(list.next_at)) : BACKUPS.never}</List.Item>
      <List.Item>{BACKUPS.folder(list.folder)}</List.Item>
      {list.same_disk && (
        <List.Item>
          <b>{BACKUPS.sameDisk}</b>
        </List.Item>
      )}
      <List.Item>
        {KEYS[list.key]}
        {list.key === "here" && BACKUPS.keyFile(list.key_file)}
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
        {items.map((backup) => (
          <Table.Tr key={backup.id}>
            <Table.Td>
              {formatMoment(backup.at)}
              <Text size="sm" c="dimmed">
                {backup.kind === "nightly" ? BACKUPS.byItself : BACKUPS.askedFor}
              </Text>
            </Table.Td>
            <Table.Td>
              {verificationText(backup)}
              {backup.audit_rows !== null && (
                <Text size="sm" {...(backup.audit_problem ? { fw: 600 } : { c: "dimmed" })}>
                  {backup.audit_problem
                    ? BACKUPS.auditBroken(backup.audit_problem)
                    : BACKUPS.auditWhole(backup.audit_rows)}
                </Text>
              )}
            </Table.Td>
            <Table.Td ta="right">{backup.problem ? "–" : formatSize(backup.bytes)}</Table.Td>
            <Table.Td>
              <Text size="sm" style={{ overflowWrap: "anywhere" }}>
                {backup.file}
              </Text>
              {backup.file && !backup.there && (
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

function verificationText(backup: Schemas["Backup"]): string {
  if (backup.problem) return BACKUPS.failed(backup.problem);
  if (backup.test_problem) return BACKUPS.notRestorable(backup.test_problem);
  if (!backup.tested_at) return BACKUPS.notTried;
  return BACKUPS.cameBack(formatMoment(backup.tested_at));
}

/** 1234567 bytes as 1.2 MB. */
const formatSize = (bytes: number): string =>
  bytes < 1_000_000 ? `${Math.ceil(bytes / 1_000)} kB` : `${(bytes / 1_000_000).toFixed(1)} MB`;
