import { Grid, Select, Stack, Text, Title } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { useNavigate, useSearch } from "@tanstack/react-router";
import { api } from "../api/client";
import { useLive, useStation } from "../live/hooks";
import { ProblemNote } from "../shared/problem";
import { useTitle } from "../shared/title";
import { Angles } from "./Angles";
import { Lately } from "./Lately";
import { LoopHealth } from "./LoopHealth";
import { PlayPanel } from "./PlayPanel";
import { SimulatorPanel } from "./SimulatorPanel";
import { TeachPanel } from "./TeachPanel";

/** Where the therapist works: whom, teach, play, and what the arm does meanwhile. */
export function StationPage() {
  const station = useStation();
  const search = useSearch({ from: "/" });
  const run = useLive("run");
  const teaching = useLive("teaching");
  const navigate = useNavigate({ from: "/" });
  useTitle(station?.name ?? "Station");
  // Whoever is on the apparatus is the one this page is about.
  const onApparatus = run?.patient?.id ?? teaching?.patient?.id;
  const patientId = onApparatus ?? search.patient ?? null;
  const patients = useQuery({
    queryKey: ["patients", "", false, 0],
    queryFn: () => api.patients("", false, 0),
  });
  const patient = useQuery({
    queryKey: ["patient", patientId],
    queryFn: () => api.patient(patientId ?? ""),
    enabled: patientId !== null,
  });
  const choices = (patients.data?.items ?? []).map((one) => ({
    value: one.id,
    label: `${one.name} (${one.clinic_number})`,
  }));
  if (patient.data && !choices.some((one) => one.value === patient.data.id)) {
    choices.push({ value: patient.data.id, label: `${patient.data.name} (${patient.data.clinic_number})` });
  }
  return (
    <Stack>
      <Title order={2} style={{ position: "absolute", left: -9999 }}>
        {station?.name ?? "Station"}
      </Title>
      <Grid gap="lg">
        <Grid.Col span={{ base: 12, md: 6 }}>
          <Stack>
            <Select
              size="lg"
              label="Patient"
              placeholder={
                choices.length ? "Who is on the apparatus?" : "Sign a patient up first, under Patients"
              }
              searchable
              data={choices}
              value={patientId}
              disabled={onApparatus !== undefined}
              onChange={(chosen) => void navigate({ search: chosen ? { patient: chosen } : {} })}
            />
            {patient.data && (
              <Text>
                {patient.data.affected_side === "left" ? "Left" : "Right"} shoulder
                {patient.data.notes ? ` · ${patient.data.notes}` : ""}
              </Text>
            )}
            <ProblemNote error={patients.error ?? patient.error} />
            {/* What cannot be done now gives its place to what is going on. */}
            {patientId && !run && <TeachPanel patientId={patientId} />}
            {patientId && !teaching && (
              <PlayPanel key={patientId} patientId={patientId} wanted={search.recording ?? null} />
            )}
            {station?.simulated && <SimulatorPanel />}
          </Stack>
        </Grid.Col>
        <Grid.Col span={{ base: 12, md: 6 }}>
          <Stack>
            <Angles />
            <Lately />
            <LoopHealth />
          </Stack>
        </Grid.Col>
      </Grid>
    </Stack>
  );
}
