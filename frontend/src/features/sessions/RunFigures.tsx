import { SimpleGrid, Skeleton, Title } from "@mantine/core";
import { useDebouncedValue } from "@mantine/hooks";
import { keepPreviousData, useQuery } from "@tanstack/react-query";
import { useState } from "react";
import { api } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { Plot } from "../../ui/Plot";
import { ProblemNote } from "../../ui/ProblemNote";
import type { PlotWindow } from "../../ui/plotWindow";
import { WindowSlider } from "./WindowSlider";

const MOTORS = [1, 2, 3, 4, 5];
const SETTLED_MS = 300;

/**
 * The paper's figure of each motor. Zooming one shows the same time in the others. `length_s` is null if
 * unknown.
 */
export function RunFigures({ runId, length_s }: { runId: string; length_s: number | null }) {
  const [window, setWindow] = useState<PlotWindow | null>(null);
  // Debounced, to skip intermediate steps.
  const [asked] = useDebouncedValue(window, SETTLED_MS);
  const figures = useQuery({
    queryKey: ["run-figures", runId, asked],
    queryFn: () => api.runFigures(runId, asked),
    placeholderData: keepPreviousData,
    staleTime: Number.POSITIVE_INFINITY,
    meta: { late: true },
  });
  return (
    <>
      <ProblemNote error={figures.error} />
      {length_s !== null && <WindowSlider length_s={length_s} window={window} onChange={setWindow} />}
      <SimpleGrid cols={{ base: 1, lg: 2 }}>
        {figures.isPending && MOTORS.map((motor) => <Skeleton key={motor} h={370} />)}
        {figures.data?.motors.map(({ motor, figure }) => (
          <div key={motor}>
            <Title order={3} size="h4">
              {t("sessions:compared.motorNumber", { motor })}
            </Title>
            <Plot figure={figure} label={t("sessions:compared.figure", { motor })} onWindow={setWindow} />
          </div>
        ))}
      </SimpleGrid>
    </>
  );
}
