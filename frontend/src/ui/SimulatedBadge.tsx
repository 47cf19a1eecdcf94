import { Badge } from "@mantine/core";
import { t } from "../lib/i18n";

/** Marks values of a simulated apparatus. */
export function SimulatedBadge({ simulated }: { simulated: boolean | undefined }) {
  if (!simulated) return null;
  return (
    <Badge variant="outline" color="grape" tt="none" data-testid="simulated">
      {t("common:simulated")}
    </Badge>
  );
}
