import {
  Button,
  Card,
  FileButton,
  Group,
  Input,
  SegmentedControl,
  Select,
  Stack,
  Text,
  Title,
} from "@mantine/core";
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

/** Torque of the simulated patient. It is above the effort that does not move a self-paced arm. */
const EFFORT_NM = 2;

/** Simulates the therapist's hand and foot and the emergency stop of a simulated apparatus. */
export function SimulatorPanel() {
  const queries = useQueryClient();
  const connected = useConnected();
  const [chosen, setChosen] = useState<string | null>(null);
  const simulator = useQuery({ queryKey: ["simulator"], queryFn: api.simulator, refetchInterval: 500 });
  const showState = (state: Schemas["SimulatorState"]) => replaceData(queries, ["simulator"], state);
  const guide = useMutation({ mutationFn: api.guide, onSuccess: showState });
  const pedal = useMutation({ mutationFn: api.setPedal, onSuccess: showState });
  const estop = useMutation({ mutationFn: api.setEstop, onSuccess: showState });
  const effort = useMutation({ mutationFn: api.setEffort, onSuccess: showState });
  const upload = useMotionUpload(setChosen);
  const state = simulator.data;
  const motions = state?.motions ?? [];
  const value = chosen ?? motions[0]?.id ?? null;
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
        <Group align="end">
          <MotionSelect motions={motions} value={value} onChange={setChosen} />
          <UploadButton uploading={upload.isPending} onFile={upload.mutate} />
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
          <Toggle
            on={state?.pedal_down}
            words={[t("station:simulator.pressPedal"), t("station:simulator.releasePedal")]}
            onToggle={pedal.mutate}
          />
          <Toggle
            on={state?.estop_pressed}
            words={[t("station:simulator.pressEstop"), t("station:simulator.releaseEstop")]}
            onToggle={estop.mutate}
          />
        </Group>
        <HandState hand={state?.hand} />
        <PatientEffort effortNm={state?.effort_nm ?? 0} onChange={effort.mutate} />
        <ProblemNote
          error={simulator.error ?? guide.error ?? upload.error ?? pedal.error ?? estop.error ?? effort.error}
        />
      </Stack>
    </Card>
  );
}

/** What the simulated patient does while the motors hold or move the arm. */
function PatientEffort({ effortNm, onChange }: { effortNm: number; onChange: (effortNm: number) => void }) {
  return (
    <Input.Wrapper
      label={t("station:simulator.effort")}
      description={t("station:simulator.effortHint", { effort: EFFORT_NM })}
      labelElement="div"
    >
      <SegmentedControl
        fullWidth
        mt="xs"
        aria-label={t("station:simulator.effort")}
        data={[
          { value: "-1", label: t("station:simulator.resists") },
          { value: "0", label: t("station:simulator.relaxed") },
          { value: "1", label: t("station:simulator.helps") },
        ]}
        value={String(Math.sign(effortNm))}
        onChange={(sign) => onChange(Number(sign) * EFFORT_NM)}
      />
    </Input.Wrapper>
  );
}

/** A button for an on/off state, with one text for switching on and one for switching off. */
function Toggle(props: {
  on: boolean | undefined;
  words: [on: string, off: string];
  onToggle: (on: boolean) => void;
}) {
  const on = props.on === true;
  return (
    <Button variant={on ? "filled" : "default"} aria-pressed={on} onClick={() => props.onToggle(!on)}>
      {props.words[on ? 1 : 0]}
    </Button>
  );
}

/** Group the motions by source for a select. */
function motionGroups(motions: Schemas["SimulatorState"]["motions"]) {
  return Object.entries(t("station:sources", { returnObjects: true }))
    .map(([source, group]) => ({
      group,
      items: motions
        .filter((motion) => motion.source === source)
        .map((motion) => ({
          value: motion.id,
          // The name of a built-in motion begins with the number of the motion.
          label: t(`station:simulator.${source === "built-in" ? "builtInOption" : "motionOption"}`, {
            name: translateServerText(motion.name, motion.name_key),
            seconds: motion.duration_s.toFixed(0),
          }),
        })),
    }))
    .filter(({ items }) => items.length > 0);
}

/** Upload a CSV file as a motion that the hand can follow. */
function useMotionUpload(onUploaded: (motionId: string) => void) {
  const queries = useQueryClient();
  return useMutation({
    mutationFn: async (file: File) => api.uploadMotion(file.name.replace(/\.csv$/i, ""), await file.text()),
    onSuccess: (motion) => {
      onUploaded(motion.id);
      void queries.invalidateQueries({ queryKey: ["simulator"] });
    },
  });
}

function UploadButton({ uploading, onFile }: { uploading: boolean; onFile: (file: File) => void }) {
  return (
    <FileButton accept=".csv,text/csv" onChange={(file) => file && onFile(file)}>
      {(props) => (
        <Button {...props} variant="default" leftSection={<IconUpload size={18} />} loading={uploading}>
          {t("station:simulator.csv")}
        </Button>
      )}
    </FileButton>
  );
}

function MotionSelect(props: {
  motions: Schemas["SimulatorState"]["motions"];
  value: string | null;
  onChange: (motionId: string | null) => void;
}) {
  return (
    <Select
      flex="1 1 15rem"
      label={t("station:simulator.motion")}
      allowDeselect={false}
      searchable
      data={motionGroups(props.motions)}
      value={props.value}
      onChange={props.onChange}
    />
  );
}

function HandState({ hand }: { hand: Schemas["SimulatorState"]["hand"] | undefined }) {
  return (
    <Text size="sm" data-testid="hand">
      {hand ? t(`station:hand.${hand.phase}`) : ""}
      {hand && hand.left_s > 0 ? t("station:simulator.remaining", { seconds: hand.left_s.toFixed(0) }) : ""}
    </Text>
  );
}
