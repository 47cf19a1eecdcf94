import { ActionIcon, Button, Group, List, Select, Stack, Text } from "@mantine/core";
import { IconTrash } from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { type FormEvent, useState } from "react";
import { api, type Episode } from "../../lib/api/client";
import { isDay, today } from "../../lib/days";
import { formatDay } from "../../lib/format";
import { t } from "../../lib/i18n";
import { DateField } from "../../ui/DateField";
import { ProblemNote } from "../../ui/ProblemNote";
import { undoStore } from "../../ui/undo";
import { useHasPermission } from "../auth/hooks";
import type { StageName } from "./messages";

const CHOICES = Object.entries(t("episodes:stages", { returnObjects: true })).map(([value, label]) => ({
  value,
  label,
}));

type Stage = Episode["stages"][number];

/** The recorded stages with their dates, with actions to add one or remove a wrong one. Removing can be undone. */
export function Stages({ episode, onSaved }: { episode: Episode; onSaved: (saved: Episode) => void }) {
  const changeable = useHasPermission("write_records") && !episode.closed_at;
  const [stage, setStage] = useState<StageName | null>(null);
  const [since, setSince] = useState(today());
  const add = useMutation({
    mutationFn: (added: StageName) => api.addStage(episode.id, { stage: added, since }),
    onSuccess: (saved) => {
      setStage(null);
      onSaved(saved);
    },
  });
  const remove = useMutation({
    mutationFn: (removed: Stage) => api.removeStage(episode.id, removed.id),
    onSuccess: (saved, { stage, since }) => {
      onSaved(saved);
      undoStore.offer({
        words: t(`ui:undo.stage.${stage}`, { day: formatDay(since) }),
        undo: async () => onSaved(await api.addStage(episode.id, { stage, since })),
      });
    },
  });
  const submit = (event: FormEvent) => {
    event.preventDefault();
    if (stage) add.mutate(stage);
  };
  return (
    <Stack gap="xs">
      <Text fw={700}>{t("episodes:stageList.title")}</Text>
      {episode.stages.length === 0 && <Text>{t("episodes:stageList.none")}</Text>}
      <List listStyleType="none">
        {episode.stages.map((recorded) => (
          <List.Item key={recorded.id}>
            <Group gap="xs">
              <Text>
                {t(`episodes:stageList.since.${recorded.stage}`, { day: formatDay(recorded.since) })}
              </Text>
              {changeable && (
                <ActionIcon
                  variant="subtle"
                  size={44}
                  aria-label={t(`episodes:stageList.remove.${recorded.stage}`, {
                    day: formatDay(recorded.since),
                  })}
                  onClick={() => remove.mutate(recorded)}
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
              label={t("episodes:stageList.newStage")}
              data={CHOICES}
              value={stage}
              onChange={(value) => setStage(value as StageName | null)}
            />
            <DateField label={t("episodes:stageList.day")} value={since} max={today()} onChange={setSince} />
            <Button
              type="submit"
              variant="default"
              disabled={!stage || !isDay(since)}
              loading={add.isPending}
            >
              {t("episodes:stageList.add")}
            </Button>
          </Group>
        </form>
      )}
      <ProblemNote error={add.error ?? remove.error} />
    </Stack>
  );
}
