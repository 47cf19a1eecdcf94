import { Alert, Badge, Button, Group, List, Skeleton, Stack, Table, Text, Title } from "@mantine/core";
import { IconCircleCheck, IconDatabaseExport, IconInfoCircle } from "@tabler/icons-react";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { api, type Schemas } from "../api/client";
import { formatMoment } from "../shared/format";
import { ProblemNote } from "../shared/problem";
import { useTitle } from "../shared/title";

const LOOK_AGAIN_MS = 2_000;

/** Backups that were made, and whether each of them was restored to see that it can be. */
export function BackupsPage() {
  useTitle("Backups");
  const queries = useQueryClient();
  const backups = useQuery({
    queryKey: ["backups"],
    queryFn: api.backups,
    refetchInterval: (query) => (query.state.data?.running ? LOOK_AGAIN_MS : false),
  });
  const make = useMutation({
    mutationFn: api.makeBackup,
    onSuccess: (told) => queries.setQueryData(["backups"], told),
  });
  const told = backups.data;
  return (
    <Stack component="section" aria-label="Backups">
      <Group justify="space-between">
        <Title order={2} size="h3">
          Backups
        </Title>
        <Button
          leftSection={<IconDatabaseExport size={20} />}
          loading={make.isPending || told?.running === true}
          onClick={() => make.mutate()}
        >
          Back up now
        </Button>
      </Group>
      <ProblemNote error={backups.error ?? make.error} />
      {backups.isPending && <Skeleton h={160} />}
      {told && (
        <>
          <LastGood told={told} />
          <Where told={told} />
          {told.running && <Text role="status">A backup is being made, and tried.</Text>}
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
      The newest good backup is of {formatMoment(good.at)}. It was restored to try it on{" "}
      {formatMoment(good.tested_at)}, and came back whole and equal.
    </Alert>
  ) : (
    <Alert color="grape" variant="light" icon={<IconInfoCircle />} role="alert" data-testid="last-good">
      There is no backup that is known to come back. Make one now.
    </Alert>
  );
}

const KEYS: Record<Schemas["BackupList"]["key"], string> = {
  here: "Without the key nobody can read a backup. It is on this computer, and is lost with it: keep a copy of the file elsewhere.",
  elsewhere:
    "The key is not on this computer, so that backups cannot be tried here. Try one where the key is.",
  nowhere: "No key has been made yet; the first backup makes it.",
};

function Where({ told }: { told: Schemas["BackupList"] }) {
  return (
    <List>
      <List.Item>
        {told.next_at
          ? `The next one is made by itself on ${formatMoment(told.next_at)}.`
          : "None is made by itself: that is switched off."}
      </List.Item>
      <List.Item>They are kept, encrypted, in {told.folder}.</List.Item>
      {told.same_disk && (
        <List.Item>
          <b>
            That is the same disk as the database&rsquo;s, and is lost with it. Choose another one with
            KATA_BACKUP_FOLDER.
          </b>
        </List.Item>
      )}
      <List.Item>
        {KEYS[told.key]} {told.key === "here" && `The file is ${told.key_file}.`}
      </List.Item>
    </List>
  );
}

function Rows({ items }: { items: Schemas["Backup"][] }) {
  return (
    <Table verticalSpacing="sm">
      <Table.Thead>
        <Table.Tr>
          <Table.Th>Made</Table.Th>
          <Table.Th>Tried</Table.Th>
          <Table.Th ta="right">Size</Table.Th>
          <Table.Th>File</Table.Th>
        </Table.Tr>
      </Table.Thead>
      <Table.Tbody>
        {items.map((one) => (
          <Table.Tr key={one.id}>
            <Table.Td>
              {formatMoment(one.at)}
              <Text size="sm" c="dimmed">
                {one.kind === "nightly" ? "By itself" : "Asked for"}
              </Text>
            </Table.Td>
            <Table.Td>{triedWords(one)}</Table.Td>
            <Table.Td ta="right">{one.problem ? "–" : sizeWords(one.bytes)}</Table.Td>
            <Table.Td>
              <Text size="sm" style={{ overflowWrap: "anywhere" }}>
                {one.file}
              </Text>
              {one.file && !one.there && (
                <Badge color="gray" tt="none">
                  No longer there
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
  if (one.problem) return `It could not be made: ${one.problem}`;
  if (one.test_problem) return `Not known to be restorable: ${one.test_problem}`;
  if (!one.tested_at) return "Not tried yet";
  return `Came back whole and equal, ${formatMoment(one.tested_at)}`;
}

/** 1234567 bytes as 1.2 MB. */
const sizeWords = (bytes: number): string =>
  bytes < 1_000_000 ? `${Math.ceil(bytes / 1_000)} kB` : `${(bytes / 1_000_000).toFixed(1)} MB`;
