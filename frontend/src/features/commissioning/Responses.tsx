import "./catalogue";
import { Stack, Text } from "@mantine/core";
import { useMemo } from "react";
import { t } from "../../lib/i18n";
import { Plot } from "../../ui/Plot";
import { loadsOf, type Response, responseFigure } from "./responseCharts";

/**
 * The step responses of the motors, with a chart for each load. The step's values are shown beside it as
 * numbers.
 */
export function Responses({ responses }: { responses: Response[] }) {
  return (
    <Stack gap="xs">
      {loadsOf(responses).map((load) => (
        <LoadResponses key={load} load={load} responses={responses} />
      ))}
    </Stack>
  );
}

function LoadResponses({ load, responses }: { load: Response["load"]; responses: Response[] }) {
  const figure = useMemo(
    () => responseFigure(responses.filter((response) => response.load === load)),
    [load, responses],
  );
  const title = t(`commissioning:responses.${load}`);
  return (
    <Stack gap={4} data-testid={`responses-${load}`}>
      <Text size="sm" fw={600}>
        {title}
      </Text>
      <Plot figure={figure} label={title} />
    </Stack>
  );
}
