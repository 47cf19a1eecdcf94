import "./catalogue";
import { SimpleGrid, Stack, Text } from "@mantine/core";
import { useMemo } from "react";
import { t } from "../../lib/i18n";
import { Plot } from "../../ui/Plot";
import { comparisons, loadsOf, newest, type Response, responseFigure } from "./responseCharts";

/**
 * The step responses of the motors, with a chart for each load. A motor whose gains were changed has a chart
 * with its former and its present response, too. The step's values are shown beside it as numbers.
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
  const { figure, compared } = useMemo(() => {
    const own = responses.filter((response) => response.load === load);
    return { figure: responseFigure(newest(own)), compared: comparisons(own) };
  }, [load, responses]);
  const title = t(`commissioning:responses.${load}`);
  return (
    <Stack gap={4} data-testid={`responses-${load}`}>
      {compared.length > 0 && (
        <SimpleGrid cols={{ base: 1, md: 2 }}>
          {compared.map(({ motor, figure: both }) => {
            const name = t("commissioning:tuning.motorTitle", { motor });
            return (
              <Stack key={motor} gap={4} data-testid={`comparison-${motor}`}>
                <Text size="sm" fw={600}>
                  {name}
                </Text>
                <Plot figure={both} label={name} />
              </Stack>
            );
          })}
        </SimpleGrid>
      )}
      <Text size="sm" fw={600}>
        {title}
      </Text>
      <Plot figure={figure} label={title} />
    </Stack>
  );
}
