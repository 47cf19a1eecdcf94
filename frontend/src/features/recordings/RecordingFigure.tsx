import "./catalogue";
import { Skeleton } from "@mantine/core";
import { keepPreviousData, useQuery } from "@tanstack/react-query";
import { useState } from "react";
import { api } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { Plot } from "../../ui/Plot";
import { ProblemNote } from "../../ui/ProblemNote";
import type { PlotWindow } from "../../ui/plotWindow";

/** The motor angles over time. Its React key must be the recording's id. */
export function RecordingFigure({ recordingId }: { recordingId: string }) {
  const [window, setWindow] = useState<PlotWindow | null>(null);
  const figure = useQuery({
    queryKey: ["recording-figure", recordingId, window],
    queryFn: () => api.recordingFigure(recordingId, window),
    placeholderData: keepPreviousData,
    staleTime: Number.POSITIVE_INFINITY,
  });
  return (
    <>
      <ProblemNote error={figure.error} />
      {figure.isPending && <Skeleton h={400} />}
      {figure.data && (
        <Plot figure={figure.data} label={t("recordings:recording.figure")} onWindow={setWindow} />
      )}
    </>
  );
}
