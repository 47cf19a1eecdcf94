import { Button, Group } from "@mantine/core";
import { IconDownload } from "@tabler/icons-react";
import { t } from "../../lib/i18n";

/** Links to download the measured samples as CSV, Parquet and MCAP. */
export function SampleLinks({
  of,
  id,
  disabled = false,
}: {
  of: "recordings" | "runs";
  id: string;
  disabled?: boolean;
}) {
  return (
    <Group gap="xs">
      {(["csv", "parquet", "mcap"] as const).map((kind) => (
        <Button
          key={kind}
          component="a"
          variant="default"
          href={`/api/${of}/${id}/samples.${kind}`}
          leftSection={<IconDownload size={20} />}
          disabled={disabled}
        >
          {t(`import-export:file.${kind}`)}
        </Button>
      ))}
    </Group>
  );
}
