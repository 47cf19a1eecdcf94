import { Button, Group, SegmentedControl } from "@mantine/core";
import { IconFileTypePdf, IconPrinter } from "@tabler/icons-react";
import type { Language } from "../shared/language";
import { usePaperLanguage } from "../shared/paperLanguage";

/** The report of a session or an episode: to be printed, or as PDF. In which language is remembered in this browser. */
export function ReportLinks({ of, id }: { of: "sessions" | "episodes"; id: string }) {
  const [language, setLanguage] = usePaperLanguage();
  const address = (kind: "html" | "pdf") => `/api/${of}/${id}/report.${kind}?language=${language}`;
  return (
    <Group gap="sm" role="group" aria-label="Report">
      <Button
        component="a"
        href={address("html")}
        target="_blank"
        rel="noreferrer"
        variant="default"
        leftSection={<IconPrinter size={20} />}
      >
        Report to print
      </Button>
      <Button
        component="a"
        href={address("pdf")}
        download
        variant="default"
        leftSection={<IconFileTypePdf size={20} />}
      >
        Report as PDF
      </Button>
      <SegmentedControl
        aria-label="Language of the report"
        size="md"
        value={language}
        onChange={(chosen) => setLanguage(chosen as Language)}
        data={[
          { value: "en", label: "English" },
          { value: "ja", label: <span lang="ja">日本語</span> },
        ]}
      />
    </Group>
  );
}
