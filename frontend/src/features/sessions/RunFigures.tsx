import { Group, SegmentedControl, SimpleGrid, Skeleton, Text, Title } from "@mantine/core";
import { useDebouncedValue } from "@mantine/hooks";
import { keepPreviousData, useQuery } from "@tanstack/react-query";
import { useState } from "react";
import { api } from "../../lib/api/client";
import { formatDeg } from "../../lib/format";
import { t } from "../../lib/i18n";
import { Plot } from "../../ui/Plot";
import { ProblemNote } from "../../ui/ProblemNote";
import type { PlotWindow } from "../../ui/plotWindow";
import { useRevealed } from "../../ui/RevealWhenLoaded";
import { WindowSlider } from "./WindowSlider";

const MOTORS = ["1", "2", "3", "4", "5"];
const ALL = "all";
const SETTLED_MS = 300;
/** Smaller differences of the clocks are shorter than one sample. */
const SHOWN_OFFSET_S = 0.01;

type Clock = "path" | "wall";
type Props = { runId: string; worstMotor: number; clockOffset_s: number | null; length_s: number | null };

/**
 * Shows the paper's figure of one motor (at first the one with the largest error), or of all motors side by
 * side. Zooming one figure shows the same time in the others. The user can choose the clock. `length_s` and
 * `clockOffset_s` are null if unknown.
 */
export function RunFigures({ runId, worstMotor, clockOffset_s, length_s }: Props) {
  const [chosen, setChosen] = useState(String(worstMotor));
  const [clock, setClock] = useState<Clock>("path");
  const [window, setWindow] = useState<PlotWindow | null>(null);
  // Debounced, so that intermediate steps cause no requests.
  const [asked] = useDebouncedValue(window, SETTLED_MS);
  const figures = useQuery({
    queryKey: ["run-figures", runId, asked, clock],
    queryFn: () => api.runFigures(runId, asked, clock),
    // A quarter megabyte, which would delay the result of the session.
    enabled: useRevealed(),
    placeholderData: keepPreviousData,
    staleTime: Number.POSITIVE_INFINITY,
    meta: { late: true },
  });
  const shown = chosen === ALL ? MOTORS : [chosen];
  return (
    <>
      <ProblemNote error={figures.error} />
      <Group>
        <SegmentedControl
          aria-label={t("sessions:compared.motor")}
          value={chosen}
          onChange={setChosen}
          data={[
            ...MOTORS.map((motor) => ({
              value: motor,
              label: t("sessions:compared.motorNumber", { motor }),
            })),
            { value: ALL, label: t("sessions:compared.allMotors") },
          ]}
        />
        <SegmentedControl
          aria-label={t("sessions:compared.clock")}
          value={clock}
          onChange={(chosen) => setClock(chosen as Clock)}
          data={[
            { value: "path", label: t("sessions:compared.clocks.path") },
            { value: "wall", label: t("sessions:compared.clocks.wall") },
          ]}
        />
        {clockOffset_s !== null && clockOffset_s >= SHOWN_OFFSET_S && (
          <Text>{t("sessions:compared.clockOffset", { offset: formatDeg(clockOffset_s, 3) })}</Text>
        )}
      </Group>
      <SimpleGrid cols={{ base: 1, lg: shown.length > 1 ? 2 : 1 }}>
        {shown.map((motor) => {
          const found = figures.data?.motors.find((figure) => String(figure.motor) === motor);
          return (
            <div key={motor}>
              {shown.length > 1 && (
                <Title order={3} size="h4">
                  {t("sessions:compared.motorNumber", { motor })}
                </Title>
              )}
              {found ? (
                <Plot
                  figure={found.figure}
                  label={t("sessions:compared.figure", { motor: found.motor })}
                  onWindow={setWindow}
                />
              ) : (
                figures.isPending && <Skeleton h={370} />
              )}
            </div>
          );
        })}
      </SimpleGrid>
      {length_s !== null && <WindowSlider length_s={length_s} window={window} onChange={setWindow} />}
    </>
  );
}
