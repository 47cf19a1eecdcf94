import { Button, Group, SegmentedControl } from "@mantine/core";
import { IconFileTypePdf, IconPrinter } from "@tabler/icons-react";
import { LANGUAGES, type Language } from "../../lib/language";
import { usePaperLanguage } from "../../lib/paperLanguage";
import { REPORT } from "./messages";

/** Links to the printable report and the PDF of a session or episode. This browser stores the language. */
export function ReportLinks({ of, id }: { of: "sessions" | "episodes"; id: string }) {
  const [language, setLanguage] = usePaperLanguage();
  const address = (kind: "html" | "pdf") => `/api/${of}/${id}/report.${kind}?language=${language}`;
  return (
    <Group gap="sm" role="group" aria-label={REPORT.title}>
      <Button
        component="a"
        href={address("html")}
        target="_blank"
        rel="noreferrer"
        variant="default"
        leftSection={<IconPrinter size={20} />}
      >
        {REPORT.print}
      </Button>
      <Button
        component="a"
        href={address("pdf")}
        download
        variant="default"
        leftSection={<IconFileTypePdf size={20} />}
      >
        {REPORT.pdf}
      </Button>
      <SegmentedControl
        aria-label={REPORT.language}
        size="md"
        value={language}
        onChange={(chosen) => setLanguage(chosen as Language)}
        data={Object.entries(LANGUAGES).map(([value, name]) => ({
          value,
          label: <span lang={value}>{name}</span>,
        }))}
      />
    </Group>
  );
}
