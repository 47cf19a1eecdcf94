import { Button, Card, FileButton, Group, Select, Stack, Text, Title } from "@mantine/core";
import { IconHandGrab, IconUpload } from "@tabler/icons-react";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import { api, type Schemas } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { useConnected } from "../../lib/live/hooks";
import { replaceData } from "../../lib/replaceData";
import { translateServerText } from "../../lib/serverText";
import { ProblemNote } from "../../ui/ProblemNote";
import classes from "./station.module.css";

/** Simulates the therapist's hand and foot and the emergency stop of a simulated apparatus. */
export function SimulatorPanel() {
  const queries = useQueryClient();
  const connected = useConnected();
  const [chosen, setChosen] = useState<string | null>(null);
  const simulator = useQuery({ queryKey: ["simulator"], queryFn: api.simulator, refetchInterval: 500 });
  const keep = (state: Schemas["SimulatorState"]) => replaceData(queries, ["simulator"], state);
  const guide = useMutation({ mutationFn: api.guide, onSuccess: keep });
  const pedal = useMutation({ mutationFn: api.setPedal, onSuccess: keep });
  const estop = useMutation({ mutationFn: api.setEstop, onSuccess: keep });
  const upload = useMutation({
    mutationFn: async (file: File) => api.uploadMotion(file.name.replace(/\.csv$/i, ""), await file.text()),
    onSuccess: (motion) => {
      setChosen(motion.id);
      void queries.invalidateQueries({ queryKey: ["simulator"] });
    },
  });
  const state = simulator.data;
  const motions = state?.motions ?? [];
  const value = chosen ?? motions[0]?.id ?? null;
  const groups = Object.entries(t("station:sources", { returnObjects: true }))
    .map(([source, group]) => ({
      group,
      items: motions
        .filter((motion) => motion.source === source)
        .map((motion) => ({
          value: motion.id,
          label: t("station:simulator.motionOption", {
            name: translateServerText(motion.name, motion.name_key),
            seconds: motion.duration_s.toFixed(0),
          }),
        })),
    }))
    .filter(({ items }) => items.length > 0);
  return (
    <Card
      withBorder
      className={classes.simulator ?? ""}
      component="section"
      aria-label={t("station:simulator.title")}
    >
      <Stack className={connected ? "" : "stale"}>
        <Title order={2} size="h3">
          {t("station:simulator.title")}
        </Title>
        <Text size="sm">{t("station:simulator.explanation")}</Text>
        <Group align="end" wrap="nowrap">
          <Select
            flex={1}
            label={t("station:simulator.motion")}
            allowDeselect={false}
            searchable
            data={groups}
            value={value}
            onChange={setChosen}
          />
          <FileButton accept=".csv,text/csv" onChange={(file) => file && upload.mutate(file)}>
            {(props) => (
              <Button
                {...props}
                variant="default"
                leftSection={<IconUpload size={18} />}
                loading={upload.isPending}
              >
                {t("station:simulator.csv")}
              </Button>
            )}
          </FileButton>
        </Group>
        <Group>
          <Button
            variant="default"
            leftSection={<IconHandGrab size={20} />}
            disabled={value === null || state?.hand.phase !== "away"}
            loading={guide.isPending}
            onClick={() => value && guide.mutate(value)}
          >
            {t("station:simulator.guide")}
          </Button>
          <Button
            variant={state?.pedal_down ? "filled" : "default"}
            aria-pressed={state?.pedal_down === true}
            onClick={() => pedal.mutate(!state?.pedal_down)}
          >
            {state?.pedal_down ? t("station:simulator.releasePedal") : t("station:simulator.pressPedal")}
          </Button>
          <Button
            variant={state?.estop_pressed ? "filled" : "default"}
            aria-pressed={state?.estop_pressed === true}
            onClick={() => estop.mutate(!state?.estop_pressed)}
          >
            {state?.estop_pressed ? t("station:simulator.releaseEstop") : t("station:simulator.pressEstop")}
          </Button>
        </Group>
        <Text size="sm" data-testid="hand">
          {state ? t(`station:hand.${state.hand.phase}`) : ""}
          {state && state.hand.left_s > 0
            ? t("station:simulator.remaining", { seconds: state.hand.left_s.toFixed(0) })
            : ""}
        </Text>
        <ProblemNote error={simulator.error ?? guide.error ?? upload.error ?? pedal.error ?? estop.error} />
      </Stack>
    </Card>
  );
}
