import { Badge } from "@mantine/core";
import { t } from "../lib/i18n";

/** Marks values of a simulated apparatus. */
export function SimulatedBadge({ simulated }: { simulated: boolean | undefined }) {
  if (!simulated) return null;
  return (
    <Badge variant="outline" color="grape" tt="none" miw="max-content" data-testid="simulated">
      {t("common:simulated")}
    </Badge>
  );
}
