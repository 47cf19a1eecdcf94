import { ActionIcon, Button, Group, List, Select, Stack, Text, TextInput } from "@mantine/core";
import { IconTrash } from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { type FormEvent, useState } from "react";
import { api, type Episode } from "../../lib/api/client";
import { formatDay } from "../../lib/format";
import { t } from "../../lib/i18n";
import { ProblemNote } from "../../ui/ProblemNote";
import { useHasPermission } from "../auth/hooks";
import { type StageName, today } from "./messages";

const CHOICES = Object.entries(t("episodes:stages", { returnObjects: true })).map(([value, label]) => ({
  value,
  label,
}));

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
      <Text fw={500}>{t("episodes:noted.title")}</Text>
      {episode.stages.length === 0 && <Text>{t("episodes:noted.none")}</Text>}
      <List listStyleType="none">
        {episode.stages.map((one) => (
          <List.Item key={one.id}>
            <Group gap="xs">
              <Text>{t(`episodes:noted.since.${one.stage}`, { day: formatDay(one.since) })}</Text>
              {changeable && (
                <ActionIcon
                  variant="subtle"
                  size={44}
                  aria-label={t(`episodes:noted.remove.${one.stage}`, { day: formatDay(one.since) })}
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
              label={t("episodes:noted.newStage")}
              data={CHOICES}
              value={stage}
              onChange={(given) => setStage(given as StageName | null)}
            />
            <TextInput
              type="date"
              label={t("episodes:noted.day")}
              value={since}
              max={today()}
              onChange={(event) => setSince(event.currentTarget.value)}
            />
            <Button type="submit" variant="default" disabled={!stage || !since} loading={add.isPending}>
              {t("episodes:noted.add")}
            </Button>
          </Group>
        </form>
      )}
      <ProblemNote error={add.error ?? remove.error} />
    </Stack>
  );
}
