import { Button, Card, Group, Select, SimpleGrid, Stack, Text, TextInput, Title } from "@mantine/core";
import { IconChartLine, IconDeviceFloppy } from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { useState } from "react";
import { api, type Edit, type Recording } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { Plot } from "../../ui/Plot";
import { ProblemNote } from "../../ui/ProblemNote";
import { isWithin, Stepper, type Steps } from "../../ui/Stepper";

type What = Edit["do"];
type NumberName =
  | "start_s"
  | "end_s"
  | "at_s"
  | "hold_s"
  | "percent"
  | "less_deg"
  | "step_deg"
  | "pause_s"
  | "further_deg"
  | "back_deg";
type Field = Steps & { name: NumberName; first: number };

const MOTORS = [1, 2, 3, 4, 5];
const SHORTEST_S = 0.5;

const ORDER: What[] = ["trim", "hold", "scale", "isolate", "warm_up", "stretch", "mirror"];

/** The fields of each edit. The bounds are the service's. */
function fieldsOf(what: What, lasts_s: number, given: Partial<Record<NumberName, number>>): Field[] {
  const end_s = Math.floor(lasts_s * 10) / 10;
  const time = { unit: t("recordings:edit.seconds"), step: 0.5 };
  const pause = { unit: t("recordings:edit.seconds"), step: 1, min: 0, max: 120 };
  switch (what) {
    case "trim":
      return [
        {
          ...time,
          name: "start_s",
          label: t("recordings:edit.from"),
          min: 0,
          max: Math.max(0, (given.end_s ?? end_s) - SHORTEST_S),
          first: 0,
        },
        {
          ...time,
          name: "end_s",
          label: t("recordings:edit.to"),
          min: (given.start_s ?? 0) + SHORTEST_S,
          max: end_s,
          first: end_s,
        },
      ];
    case "hold":
      return [
        {
          ...time,
          name: "at_s",
          label: t("recordings:edit.at"),
          min: 0,
          max: end_s,
          first: Math.floor(end_s) / 2,
        },
        {
          name: "hold_s",
          label: t("recordings:edit.duration"),
          unit: t("recordings:edit.seconds"),
          step: 1,
          min: 1,
          max: 600,
          first: 5,
        },
      ];
    case "scale":
      return [
        {
          name: "percent",
          label: t("recordings:edit.range"),
          unit: t("recordings:edit.percent"),
          step: 5,
          min: 10,
          max: 95,
          first: 80,
        },
      ];
    case "warm_up":
      return [
        {
          name: "less_deg",
          label: t("recordings:edit.lessBy"),
          unit: t("recordings:edit.deg"),
          step: 1,
          min: 1,
          max: 180,
          first: 15,
        },
        {
          name: "step_deg",
          label: t("recordings:edit.widerBy"),
          unit: t("recordings:edit.deg"),
          step: 0.5,
          min: 0.5,
          max: 30,
          first: 3,
        },
        { ...pause, name: "pause_s", label: t("recordings:edit.pause"), first: 0 },
      ];
    case "stretch":
      return [
        {
          name: "further_deg",
          label: t("recordings:edit.further"),
          unit: t("recordings:edit.deg"),
          step: 1,
          min: 0,
          max: 15,
          first: 3,
        },
        {
          name: "back_deg",
          label: t("recordings:edit.back"),
          unit: t("recordings:edit.deg"),
          step: 1,
          min: 1,
          max: 30,
          first: 5,
        },
        { ...pause, name: "hold_s", label: t("recordings:edit.hold"), first: 10 },
      ];
    case "isolate":
    case "mirror":
      return [];
  }
}

function editOf(what: What, number: (name: NumberName) => number, motors: number[]): Edit {
  switch (what) {
    case "trim":
      return { do: what, start_s: number("start_s"), end_s: number("end_s") };
    case "hold":
      return { do: what, at_s: number("at_s"), hold_s: number("hold_s") };
    case "scale":
      return { do: what, percent: number("percent"), motors };
    case "isolate":
      return { do: what, motors };
    case "warm_up":
      return {
        do: what,
        less_deg: number("less_deg"),
        step_deg: number("step_deg"),
        pause_s: number("pause_s"),
      };
    case "stretch":
      return {
        do: what,
        further_deg: number("further_deg"),
        back_deg: number("back_deg"),
        hold_s: number("hold_s"),
      };
    case "mirror":
      return { do: what };
  }
}

/**
 * Edits a recording: choose an edit, preview it, and save it as a new recording. The original stays
 * unchanged.
 */
export function EditPanel({
  recording,
  onKept,
}: {
  recording: Recording;
  onKept: (made: Recording) => void;
}) {
  const [what, setWhat] = useState<What>("trim");
  const [given, setGiven] = useState<Partial<Record<NumberName, number>>>({});
  const [motors, setMotors] = useState(MOTORS);
  const [name, setName] = useState("");
  const fields = fieldsOf(what, recording.duration_s, given);
  const first = (wanted: NumberName) => fields.find((field) => field.name === wanted)?.first ?? 0;
  const number = (wanted: NumberName) => given[wanted] ?? first(wanted);
  const edit = editOf(what, number, motors);
  const preview = useMutation({ mutationFn: (wanted: Edit) => api.previewDerived(recording.id, wanted) });
  const keep = useMutation({
    mutationFn: (wanted: Edit) => api.derive(recording.id, wanted),
    onSuccess: onKept,
  });
  // Only the previewed edit can be saved; another number needs a new preview.
  const seen = JSON.stringify(preview.variables) === JSON.stringify(edit);
  const byMotor = what === "scale" || what === "isolate";
  const toggle = (motor: number) =>
    setMotors(MOTORS.filter((one) => (one === motor) !== motors.includes(one)));
  return (
    <Card withBorder component="section" aria-label={t("recordings:edit.section")}>
      <Stack>
        <Title order={2} size="h3">
          {t("recordings:edit.title")}
        </Title>
        <Select
          size="lg"
          label={t("recordings:edit.type")}
          allowDeselect={false}
          data={ORDER.map((value) => ({ value, label: t(`recordings:whats.${value}.label`) }))}
          value={what}
          onChange={(wanted) => {
            const chosen = ORDER.find((one) => one === wanted);
            if (!chosen) return;
            setWhat(chosen);
            setGiven({});
          }}
        />
        <Text size="sm">{t(`recordings:whats.${what}.what`)}</Text>
        {byMotor && (
          <Group gap="xs" role="group" aria-label={t("recordings:edit.motors")}>
            {MOTORS.map((motor) => (
              <Button
                key={motor}
                size="lg"
                variant={motors.includes(motor) ? "filled" : "default"}
                aria-pressed={motors.includes(motor)}
                onClick={() => toggle(motor)}
              >
                {t("recordings:edit.motor", { motor })}
              </Button>
            ))}
          </Group>
        )}
        {fields.length > 0 && (
          <SimpleGrid cols={{ base: 1, sm: 3 }}>
            {fields.map((field) => (
              <Stepper
                key={field.name}
                field={field}
                value={number(field.name)}
                onChange={(value) => setGiven({ ...given, [field.name]: value })}
              />
            ))}
          </SimpleGrid>
        )}
        <Group>
          <Button
            size="lg"
            variant={seen && preview.data ? "default" : "filled"}
            leftSection={<IconChartLine size={22} />}
            loading={preview.isPending}
            disabled={
              (byMotor && motors.length === 0) ||
              !fields.every((field) => isWithin(field, number(field.name)))
            }
            onClick={() => preview.mutate(edit)}
          >
            {t("recordings:edit.preview")}
          </Button>
        </Group>
        {seen && <ProblemNote error={preview.error} />}
        {seen && preview.data && (
          <>
            <Plot figure={preview.data} label={t("recordings:edit.figure")} />
            <Group align="end">
              <TextInput
                size="lg"
                flex={1}
                label={t("recordings:edit.name")}
                placeholder={t("recordings:edit.unnamed", { recording: recording.name })}
                value={name}
                maxLength={100}
                onChange={(event) => setName(event.currentTarget.value)}
              />
              <Button
                size="lg"
                leftSection={<IconDeviceFloppy size={22} />}
                loading={keep.isPending}
                onClick={() => keep.mutate({ ...edit, ...(name.trim() && { name: name.trim() }) })}
              >
                {t("recordings:edit.save")}
              </Button>
            </Group>
            <ProblemNote error={keep.error} />
          </>
        )}
      </Stack>
    </Card>
  );
}
