import { SimpleGrid, Skeleton, Title } from "@mantine/core";
import { keepPreviousData, useQuery } from "@tanstack/react-query";
import { useState } from "react";
import { api } from "../api/client";
import { Plot } from "../shared/Plot";
import { ProblemNote } from "../shared/problem";
import type { PlotWindow } from "../shared/window";
import { COMPARED } from "./words";

const MOTORS = [1, 2, 3, 4, 5];

/** The paper's figure of each motor. Looking closer at one shows the same seconds of the others. */
export function RunFigures({ runId }: { runId: string }) {
  const [window, setWindow] = useState<PlotWindow | null>(null);
  const figures = useQuery({
    queryKey: ["run-figures", runId, window],
    queryFn: () => api.runFigures(runId, window),
    placeholderData: keepPreviousData,
    staleTime: Number.POSITIVE_INFINITY,
    meta: { late: true },
  });
  return (
    <>
      <ProblemNote error={figures.error} />
      <SimpleGrid cols={{ base: 1, lg: 2 }}>
        {figures.isPending && MOTORS.map((motor) => <Skeleton key={motor} h={370} />)}
        {figures.data?.motors.map(({ motor, figure }) => (
          <div key={motor}>
            <Title order={3} size="h4">
              {COMPARED.motorNumber(motor)}
            </Title>
            <Plot figure={figure} label={COMPARED.figure(motor)} onWindow={setWindow} />
          </div>
        ))}
      </SimpleGrid>
    </>
  );
}
