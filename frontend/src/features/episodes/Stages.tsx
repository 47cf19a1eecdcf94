import { ActionIcon, Button, Group, List, Select, Stack, Text, TextInput } from "@mantine/core";
import { IconTrash } from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { type FormEvent, useState } from "react";
import { api, type Episode } from "../../lib/api/client";
import { formatDay } from "../../lib/format";
import { ProblemNote } from "../../ui/ProblemNote";
import { useHasPermission } from "../auth/hooks";
import { NOTED, STAGES, type StageName, today } from "./messages";

const CHOICES = Object.entries(STAGES).map(([value, label]) => ({ value, label }));

/** The recorded stages with their dates, and actions to add one or remove a wrong one. */
export function Stages({ episode, onSaved }: { episode: Episode; onSaved: (saved: Episode) => void }) {
  const changeable = useHasPermission("write_records") && !episode.closed_at;
  const [stage, setStage] = useState<StageName | null>(null);
  const [since, setSince] = useState(today());
  const add = useMutation({
    mutationFn: (wanted: StageName) => api.addStage(episode.id, { stage: wanted, since }),
    onSuccess: (saved) => {
      setStage(null);
      onSaved(saved);
    },
  });
  const remove = useMutation({
    mutationFn: (stageId: string) => api.removeStage(episode.id, stageId),
    onSuccess: onSaved,
  });
  const submit = (event: FormEvent) => {
    event.preventDefault();
    if (stage) add.mutate(stage);
  };
  return (
    <Stack gap="xs">
      <Text fw={500}>{NOTED.title}</Text>
      {episode.stages.length === 0 && <Text>{NOTED.none}</Text>}
      <List listStyleType="none">
        {episode.stages.map((one) => (
          <List.Item key={one.id}>
            <Group gap="xs">
              <Text>{NOTED.since(one.stage, formatDay(one.since))}</Text>
              {changeable && (
                <ActionIcon
                  variant="subtle"
                  size={44}
                  aria-label={NOTED.remove(one.stage, formatDay(one.since))}
                  onClick={() => remove.mutate(one.id)}
                >
                  <IconTrash size={20} />
                </ActionIcon>
              )}
            </Group>
          </List.Item>
        ))}
      </List>
      {changeable && (
        <form onSubmit={submit}>
          <Group align="end">
            <Select
              label={NOTED.newStage}
              data={CHOICES}
              value={stage}
              onChange={(given) => setStage(given as StageName | null)}
            />
            <TextInput
              type="date"
              label={NOTED.day}
              value={since}
              max={today()}
              onChange={(event) => setSince(event.currentTarget.value)}
            />
            <Button type="submit" variant="default" disabled={!stage || !since} loading={add.isPending}>
              {NOTED.add}
            </Button>
          </Group>
        </form>
      )}
      <ProblemNote error={add.error ?? remove.error} />
    </Stack>
  );
}
