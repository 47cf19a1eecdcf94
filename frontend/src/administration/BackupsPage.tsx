import { Alert, Button, Group, Skeleton, Stack, Table, Text, Title } from "@mantine/core";
import { IconCircleCheck, IconDatabaseExport, IconInfoCircle } from "@tabler/icons-react";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { api, type Schemas } from "../api/client";
import { formatMoment } from "../shared/format";
import { ProblemNote } from "../shared/problem";
import { useTitle } from "../shared/title";

const MEGABYTE = 1_000_000;

/** Backups that were made, and whether each of them was restored to see that it can be. */
export function BackupsPage() {
  useTitle("Backups");
  const queries = useQueryClient();
  const backups = useQuery({ queryKey: ["backups"], queryFn: api.backups });
  const make = useMutation({
    mutationFn: api.makeBackup,
    onSettled: () => void queries.invalidateQueries({ queryKey: ["backups"] }),
  });
  return (
    <Stack component="section" aria-label="Backups">
      <Group justify="space-between">
        <Title order={3}>Backups</Title>
        <Button
          leftSection={<IconDatabaseExport size={20} />}
          loading={make.isPending}
          onClick={() => make.mutate()}
        >
          Back up now
        </Button>
      </Group>
      <ProblemNote error={backups.error ?? make.error} />
      {backups.isPending && <Skeleton h={160} />}
      {backups.data && <Told told={backups.data} />}
    </Stack>
  );
}
