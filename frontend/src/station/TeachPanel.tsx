import { Card, Group, List, SegmentedControl, Stack, Text, TextInput, Title } from "@mantine/core";
import { IconHandGrab, IconPlayerRecordFilled, IconShoe } from "@tabler/icons-react";
import { useEffect, useState } from "react";
import { useName } from "../access/hooks";
import { api, type Schemas } from "../api/client";
import { useAlive, useLive } from "../live/hooks";
import { store } from "../live/store";
import { formatSpan } from "../shared/format";
import { PageLink } from "../shared/links";
import { CommandButton } from "./CommandButton";
import classes from "./station.module.css";

type Fixtures = NonNullable<Schemas["TeachRequest"]["fixtures"]>;

/** Teaching: torque is off, the therapist moves the arm, and what is done with the pedal down is recorded. */
export function TeachPanel({ patientId }: { patientId: string }) {
  const alive = useAlive();
  const teaching = useLive("teaching");
  const who = useName();
  const [name, setName] = useState("");
  const [fixtures, setFixtures] = useState("arm_fixer_1");
  const saved = useSavedTakes(patientId, teaching?.teaching_id ?? null);
  return (
    <Card withBorder component="section" aria-label="Teach">
      <Stack>
        <Title order={2} size="h3">
          Teach
        </Title>
        {teaching ? (
          <div className={alive ? "" : "stale"}>
            <Pedal />
            <Group justify="space-between" mt="md">
              <Text size="lg" data-testid="takes">
                {teaching.takes === 0
                  ? "Nothing recorded yet"
                  : `Take ${teaching.takes}: ${teaching.take_s.toFixed(1)} s`}
              </Text>
              <CommandButton command="finish_teaching" send={api.finishTeaching}>
                Finish teaching
              </CommandButton>
            </Group>
          </div>
        ) : (
          <>
            <SegmentedControl
              size="md"
              aria-label="What the arm is in"
              value={fixtures}
              onChange={setFixtures}
              data={[
                { value: "arm_fixer_1", label: "Arm fixer 1 (motions 1 to 5)" },
                { value: "arm_fixer_2,elbow_fixer_1", label: "Arm fixer 2 and elbow fixer 1 (motion 6)" },
              ]}
            />
            <TextInput
              size="lg"
              label="Name of the motion"
              placeholder="Motion"
              value={name}
              maxLength={100}
              onChange={(event) => setName(event.currentTarget.value)}
            />
            <CommandButton
              command="teach"
              leftSection={<IconHandGrab size={26} />}
              send={() =>
                api.teach({
                  patient_id: patientId,
                  name: name.trim() || "Motion",
                  taught_by: who,
                  fixtures: fixtures.split(",") as Fixtures,
                })
              }
            >
              Start teaching
            </CommandButton>
          </>
        )}
        {saved.length > 0 && (
          <List data-testid="saved">
            {saved.map((one) => (
              <List.Item key={one.id}>
                Saved:{" "}
                <PageLink to="/recordings/$recordingId" params={{ recordingId: one.id }}>
                  {one.name}
                </PageLink>
                , {formatSpan(one.duration_s)}
              </List.Item>
            ))}
          </List>
        )}
      </Stack>
    </Card>
  );
}

/** To be read from two metres: is it recording or not. */
function Pedal() {
  const pedal = useLive("pedal");
  const teaching = useLive("teaching");
  const recording = teaching?.recording === true;
  const words =
    pedal === "stuck"
      ? "Lift your foot off the pedal first"
      : pedal === "unknown"
        ? "The pedal does not answer"
        : recording
          ? "Recording"
          : "Press the pedal to record";
  return (
    <Group
      className={classes.pedal ?? ""}
      data-recording={recording}
      data-testid="pedal"
      role="status"
      aria-live="assertive"
    >
      {recording ? <IconPlayerRecordFilled size={48} /> : <IconShoe size={48} />}
      <Text fz={28} fw={700}>
        {words}
      </Text>
      {recording && (
        <Text fz={28} ml="auto" ff="monospace">
          {teaching.take_s.toFixed(1)} s
        </Text>
      )}
    </Group>
  );
}

/** The takes of the present or last teaching, as they reach the database. */
function useSavedTakes(patientId: string, teachingId: string | null): Schemas["Recording"][] {
  const [takes, setTakes] = useState<Schemas["Recording"][]>([]);
  // A new teaching begins a new list.
  useEffect(() => {
    if (teachingId) setTakes([]);
  }, [teachingId]);
  useEffect(
    () =>
      store.onSaved((saved) => {
        if (saved.what !== "recording" || saved.patient_id !== patientId) return;
        void api.recording(saved.id).then((recording) => setTakes((before) => [...before, recording]));
      }),
    [patientId],
  );
  return takes;
}
