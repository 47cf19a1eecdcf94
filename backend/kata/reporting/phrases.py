"""Phrases of a report in English and Japanese, and its formats of numbers, dates and times."""

from datetime import date, datetime
from typing import Final, Literal

from kata.clinic.assessments import rom
from kata.clinic.local_time import zone_of
from kata.clinic.rounding import as_shown, change_as_shown
from kata.device.ipc_messages import RESISTANCE_LEVELS
from kata.reporting.joining import join_units

Language = Literal["en", "ja"]
LANGUAGES: Final[tuple[Language, ...]] = ("en", "ja")

_MONTHS: Final = ("Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec")

_MOST_DECIMALS: Final = 3
"""A difference of two entered numbers has binary fractions beyond these decimals."""

PHRASES: Final[dict[str, tuple[str, str]]] = {
    # Both reports
    "patient": ("Patient", "患者"),
    "name": ("Name", "氏名"),
    "clinic_number": ("Clinic number", "患者番号"),
    "birth_date": ("Date of birth", "生年月日"),
    "years": ("{years} years", "{years}歳"),
    "sex": ("Sex", "性別"),
    "sex.female": ("Female", "女性"),
    "sex.male": ("Male", "男性"),
    "sex.other": ("Other", "その他"),
    "sex.unknown": ("Not stated", "記載なし"),
    "treated_side": ("Treated shoulder", "治療側の肩"),
    "side.left": ("Left", "左"),
    "side.right": ("Right", "右"),
    "diagnosis": ("Diagnosis", "診断名"),
    "diagnosis_words": ("Description", "診断の説明"),
    "diagnosis.M75.0": ("Adhesive capsulitis (frozen shoulder, M75.0)", "凍結肩（癒着性関節包炎、M75.0）"),
    "diagnosis.M75.1": ("Rotator cuff syndrome (M75.1)", "腱板症候群（M75.1）"),
    "diagnosis.M75.2": ("Bicipital tendinitis (M75.2)", "上腕二頭筋腱炎（M75.2）"),
    "diagnosis.M75.3": ("Calcific tendinitis of the shoulder (M75.3)", "肩の石灰沈着性腱炎（M75.3）"),
    "diagnosis.M75.4": ("Impingement syndrome of the shoulder (M75.4)", "肩のインピンジメント症候群（M75.4）"),
    "diagnosis.M75.5": ("Bursitis of the shoulder (M75.5)", "肩の滑液包炎（M75.5）"),
    "diagnosis.S42.2": ("Fracture of the upper end of the humerus (S42.2)", "上腕骨近位端骨折（S42.2）"),
    "diagnosis.S43.0": ("Dislocation of the shoulder joint (S43.0)", "肩関節脱臼（S43.0）"),
    "verification": ("Certainty of the diagnosis", "診断の確からしさ"),
    "verification.unconfirmed": ("Unconfirmed", "未確認"),
    "verification.provisional": ("Provisional", "暫定"),
    "verification.differential": ("Differential", "鑑別中"),
    "verification.confirmed": ("Confirmed", "確定"),
    "phone": ("Tel. {number}", "電話 {number}"),
    "printed": ("Printed {moment}", "印刷日時 {moment}"),
    "by_kata": ("Kata {version}", "Kata {version}"),
    "none": ("None", "なし"),
    "comma": (", ", "、"),
    "not_recorded": ("Not recorded", "記録なし"),
    "number": ("No.", "番号"),
    "draft": ("DRAFT, NOT SIGNED", "下書き・未署名"),
    "to": ("{first} to {last}", "{first}〜{last}"),
    # Commissioning
    "commissioning_report": ("Commissioning record", "装置の調整記録"),
    "not_passed": ("NOT COMMISSIONED", "調整未完了"),
    "commissioned_by": ("Commissioned by", "実施者"),
    "version": ("Version", "バージョン"),
    "configuration_hash": ("Hash of the configuration", "設定のハッシュ"),
    "record_hash": ("Hash of this record", "この記録のハッシュ"),
    "record_signature": ("Signature of the station (Ed25519)", "ステーションの署名（Ed25519）"),
    "record_signature_state.valid": ("valid", "有効"),
    "record_signature_state.invalid": (
        "NOT VALID: the record was changed after it was signed",
        "無効：署名後に記録が変更されています",
    ),
    "record_signature_state.unsigned": ("not signed (earlier release of Kata)", "署名なし（Kataの以前の版）"),
    "public_key": ("Public key of the station", "ステーションの公開鍵"),
    "former_record": ("Hash of the previous record", "前の記録のハッシュ"),
    "commissioning_steps": ("Steps", "手順"),
    "commissioning_step": ("Step", "手順"),
    "result": ("Result", "結果"),
    "passed": ("Passed", "合格"),
    "value": ("Value", "項目"),
    "value_before": ("Before", "前"),
    "value_after": ("After", "後"),
    "step_responses.weight": ("Step responses with the test weight.", "ステップ応答（試験用おもりあり）。"),
    "step_responses.empty": ("Step responses without a weight.", "ステップ応答（おもりなし）。"),
    "step_response_lines": (
        "Solid line: kept gains; dashed line: former gains; thin line: the step.",
        "実線：確定したゲイン、破線：以前のゲイン、細線：指令値",
    ),
    "signature_line": ("Date, signature: ______________________________", "日付・署名：______________________________"),
    "simulated": (
        "SIMULATED APPARATUS: the measured values are not those of a patient",
        "模擬装置：測定値は架空であり、患者のものではない",
    ),
    "simulated_session": ("simulated", "模擬装置"),
    # The session
    "session_report": ("Session report", "治療セッション報告書"),
    "session": ("Session", "セッション"),
    "date": ("Date", "日付"),
    "time": ("Time", "時刻"),
    "still_open": ("{start}, still open", "{start} 〜（継続中）"),
    "minutes": ("{minutes} min", "{minutes}分"),
    "therapist": ("Therapist", "担当療法士"),
    "station": ("Station", "装置"),
    "end": ("Reason for ending", "終了理由"),
    "end.completed": ("Completed as planned", "予定どおり終了"),
    "end.shortened": ("Shortened by the therapist", "短縮して終了"),
    "end.stopped": ("Ended by a stop", "停止のため終了"),
    "end.patient_request": ("At the patient's request", "患者の希望により終了"),
    "end.other": ("Other reason", "その他の理由で終了"),
    "note": ("Note", "所見"),
    "no_note": ("No note has been written.", "所見は記入されていない。"),
    "signed": ("Signed by {name}, {moment}", "署名：{name}（{moment}）"),
    "not_signed": (
        "Not signed. This is a draft and may still change.",
        "未署名。これは下書きであり、今後変更されることがある。",
    ),
    "signature": ("Signature", "署名"),
    "addenda": ("Addenda", "追記"),
    "pain": ("Pain, 0 to 10", "痛み（0〜10）"),
    "pain_before": ("Before", "治療前"),
    "pain_during": ("During", "治療中"),
    "pain_after": ("After", "治療後"),
    "stops": ("Stops", "停止"),
    "no_stops": ("There were no stops.", "停止はなかった。"),
    "cause": ("Cause", "原因"),
    "checklist": ("Checklist before the start", "開始前の確認"),
    "check": ("Check", "確認事項"),
    "confirmed": ("Confirmed", "確認"),
    "detected": ("detected by the apparatus", "装置が検出"),
    "check.identity": (
        "The patient's identity is confirmed by two identifiers",
        "2つの識別情報により本人であることを確認した",
    ),
    "check.side": (
        "The apparatus is set up for this shoulder, and its pin is in",
        "装置の左右が合い、ピンが差し込まれている",
    ),
    "check.fixtures": (
        "The arm lies in its fixtures, and all fixtures are closed",
        "腕が固定具に収まり、固定具がすべて閉じている",
    ),
    "check.belt": ("The belt holds the patient in the seat", "ベルトで患者が座席に固定されている"),
    "check.pedal": ("The foot pedal answers", "フットペダルが反応する"),
    "check.estop": ("The emergency stop was pressed and released today", "本日、非常停止を押して解除した"),
    "identifier.name": ("name", "氏名"),
    "identifier.birth_date": ("birth date", "生年月日"),
    "identifier.clinic_number": ("clinic number", "患者番号"),
    "fixture.arm_fixer_1": ("arm fixer 1", "腕固定具1"),
    "fixture.arm_fixer_2": ("arm fixer 2", "腕固定具2"),
    "fixture.elbow_fixer_1": ("elbow fixer 1", "肘固定具1"),
    "fixture.elbow_fixer_2": ("elbow fixer 2", "肘固定具2"),
    "programme": ("Programme: planned and done", "プログラム：予定と実施"),
    "programme_version": ("{name}, version {version}", "{name}（第{version}版）"),
    "prescribed_by": ("prescribed by {name}", "処方：{name}"),
    "timer": ("timer {minutes} min", "タイマー {minutes}分"),
    "planned": ("Planned", "予定"),
    "done": ("Done", "実施"),
    "not_done": ("Not done", "未実施"),
    "done_of": ("{done} of {planned} repetitions", "{planned}回中{done}回"),
    "done_of_one": ("{done} of {planned} repetition", "{planned}回中{done}回"),
    "run_number": ("playback {number}", "再生{number}"),
    "besides": ("Playbacks outside the programme: {numbers}", "プログラム外の再生：{numbers}"),
    "no_programme": (
        "Recordings were chosen individually, without a programme.",
        "プログラムによらず、記録を個別に選んで再生した。",
    ),
    "runs": ("Playbacks", "再生"),
    "run": ("Playback", "再生"),
    "no_runs": ("Nothing was played in this session.", "このセッションでは何も再生されていない。"),
    "recording": ("Recording", "記録"),
    "settings": ("Settings", "設定"),
    "outcome": ("Outcome", "結果"),
    "outcome.loaded": ("In progress", "継続中"),
    "outcome.completed": ("Played to its end", "最後まで再生"),
    "outcome.returned": ("Ended early", "途中で終了"),
    "outcome.stopped": ("Stopped", "停止"),
    "outcome.unloaded": ("Not played", "再生せず"),
    "outcome.interrupted": ("Interrupted: the control program ended", "中断（制御プログラムの終了）"),
    "worst_rmse": ("RMSE, °", "RMSE, °"),
    "worst_peak": ("Peak, °", "最大誤差°"),
    "worst_of": (
        "Tracking error: playback minus the requested motion, without the start, of the motor with the largest error. "
        "Partial: less than 90\u00a0% of the playing time was compared, or the playback ended before its first repetition was complete. "
        "A dash means that nothing was compared.",
        "追従誤差は「再生−要求した動作」（開始時を除く）。5個のモータのうち最大のものを示す。「部分的」は再生時間の90%未満の比較、または最初の反復の完了前に終わった再生。"
        "「–」は比較なし。",
    ),
    "speed": ("speed {percent}\u00a0%", "速度{percent}%"),
    "repetitions": ("repetitions\u00a0{count}", "反復{count}回"),
    "pause": ("pause {seconds}\u00a0s", "休止{seconds}秒"),
    "range": ("range {percent}\u00a0%", "可動範囲{percent}%"),
    "level": ("resistance level\u00a0{level}", "抵抗許容レベル{level}"),
    "method.paper": ("as in the paper, 10 Hz", "論文方式（10 Hz）"),
    "method.smooth": ("smooth", "平滑"),
    "method.learned": ("smooth, learned", "平滑・学習"),
    "rate": ("{rate}\u00a0Hz", "{rate}\u00a0Hz"),
    "reversals": ("moved back by resistance: {count}", "抵抗による引き戻し{count}回"),
    "least_range": ("smallest range {percent}\u00a0%", "最小可動範囲{percent}%"),
    "self_paced": ("pace set by the patient", "患者のペース"),
    "mean_pace": ("mean pace {percent}\u00a0%", "平均ペース{percent}%"),
    "patients_work": (
        "patient's mean effort {effort}\u00a0Nm, work {work}\u00a0J (estimates)",
        "患者の平均の力{effort}\u00a0Nm、仕事{work}\u00a0J（推定値）",
    ),
    "run_details": ("Each playback compared with teaching", "各再生：教示と再生の比較"),
    "legend": (
        "Motor angles in degrees over the motion's time. Solid line: teaching with the settings of the playback; dashed line: playback.",
        "動作の時間に対するモータ角度（°）。実線：設定を適用した教示、破線：再生。",
    ),
    "motor": ("Motor", "モータ"),
    "motor_number": ("Motor {number}", "モータ{number}"),
    "motor_curve": ("Motor {number}, ° over s", "モータ{number}：角度(°)と時間(秒)"),
    "peak": ("Peak, °", "最大(°)"),
    "rmse": ("RMSE, °", "RMSE(°)"),
    "start": ("Start, °", "開始時(°)"),
    "lag": ("Lag, ms", "遅れ(ms)"),
    "torque": ("Torque, Nm", "トルク(Nm)"),
    "wall_peak": ("Real time, °", "実時間(°)"),
    "by_settings": ("Change, °", "変更(°)"),
    "errors_caption": (
        "Motor angle: tracking error, change by settings, and the largest torque",
        "モータ角度：追従誤差、設定による変更、最大トルク",
    ),
    "errors_explained": (
        "Tracking error (peak, RMSE, start) is playback minus the requested motion: the taught motion with the range, speed and "
        "repetitions of the playback. The start is the first half second. Change by settings is the requested minus the taught motion, including a "
        "reduced range. “Real time” is the peak when compared in real time instead of motion time.",
        "追従誤差（最大、RMSE、開始時）は「再生−要求した動作」。要求した動作は、教示した測定点に再生の範囲・速度・反復を適用したもの。開始時は最初の0.5秒。"
        "設定による変更は「要求−教示」（可動範囲を狭めた分を含む）。「実時間」は、動作の時間ではなく実時間で比較した最大誤差。",
    ),
    "compared": ("compared: {percent}\u00a0% of the playing time", "再生時間の{percent}%を比較"),
    "partial": ("partial", "部分的"),
    "clock_offset": ("real time ahead by up to {seconds}\u00a0s", "実時間との差 最大{seconds}秒"),
    "old_figures": ("peak and RMSE include the start", "最大誤差とRMSEは開始時を含む"),
    "motion": ("Motion", "動作"),
    "asked": ("Requested, °", "要求(°)"),
    "reached": ("Apparatus angle reached, °", "到達した装置角度(°)"),
    "apparatus_angle": (
        "These are angles of the apparatus, not of a goniometer: the arm can slip in its cuff (Sun et al., Robotics 2025, 14, 12).",
        "角度計の値ではなく装置の角度である。腕は固定具の中で滑ることがある(Sun et al., Robotics 2025, 14, 12)。",
    ),
    "patient_angle": ("Patient's angle, °", "患者の角度(°)"),
    "patient_angle_value": (
        "{low:.0f}° ± {low_u:.0f}° to {high:.0f}° ± {high_u:.0f}°",
        "{low:.0f}° ± {low_u:.0f}° 〜 {high:.0f}° ± {high_u:.0f}°",
    ),
    "patient_angle_explained": (
        "The patient's angle is estimated from goniometer readings at two or more poses in this session; it lies within ± in 95\u00a0% of cases. The estimate includes "
        "the apparatus angle, a constant difference, a difference that grows with the angle, and slip over time. The sizes of the differences "
        "are from publications; the size of the slip is an assumption. Without readings only the apparatus angle of a motion is known.",
        "患者の角度は、このセッションの2肢位以上での角度計の測定値から推定した値で、±は95%の範囲を示す。装置角度、一定の差、角度とともに増える差、時間とともに"
        "増える滑りを考慮した。これらの大きさは文献によるが、滑りの大きさは仮定である。測定値のない動作では装置角度のみが分かる。",
    ),
    "goniometer": ("Goniometer readings", "角度計の測定値"),
    "goniometer_apparatus": ("Apparatus angle, °", "装置角度(°)"),
    "goniometer_reading": ("Goniometer, °", "角度計(°)"),
    "goniometer_by": ("Read by", "測定者"),
    "end_feel": ("End-feel test", "エンドフィール検査"),
    "end_feel_explained": (
        "Angles of the apparatus, not of the patient, at 60 % (range) and 25 % (onset) of the chosen torque: the arm can slip in its cuff. ± is the "
        "95 % interval over three repetitions; it does not contain the slip. The torque is the drive's current times a nominal factor. The test was "
        "tried in simulation only.",
        "選んだトルクの60%(可動域)と25%(抵抗の開始)での装置角度で、患者の角度ではない。腕は固定具の中で滑ることがある。±は3回の往復にわたる95%区間で、滑りを含まない。トルクはモータの電流に公称係数を掛けた値で、この検査は"
        "シミュレーションでのみ試されている。",
    ),
    "end_feel_baseline": ("Baseline of an end-feel test", "エンドフィール検査の基準測定"),
    "stretch": ("Stretch", "ストレッチ"),
    "stretch_held": ("stretch, held for {seconds} s", "ストレッチ、保持{seconds}秒"),
    "end_feel_torque": ("Torque, Nm", "トルク(Nm)"),
    "end_feel_range": ("Range, °", "可動域(°)"),
    "end_feel_onset": ("Onset, °", "抵抗の開始(°)"),
    "end_feel_stiffness": ("Stiffness, Nm/°", "スティフネス(Nm/°)"),
    "end_feel_curve": (
        "Playback {number}, {motion}: torque, Nm, over the apparatus angle",
        "再生{number}、{motion}：装置角度に対するトルク(Nm)",
    ),
    "end_feel_legend": (
        "Torque between apparatus and shoulder, without weight and friction. Dotted line: way out; dashed line: way back; solid line: their mean, "
        "with dots at onset and range.",
        "装置と肩の間のトルク（重さと摩擦を除く）。点線：往路、破線：復路、実線：平均。丸は抵抗の開始と可動域。",
    ),
    "unmeasured.arm_not_weighed": ("the arm could not be weighed", "腕の重さを測定できなかった"),
    "unmeasured.torque_not_reached": ("the torque was not reached", "トルクに達しなかった"),
    "unmeasured.resistance_from_start": ("resistance begins at the start", "開始位置から抵抗がある"),
    "unmeasured.guarding": ("the patient worked with or against the apparatus", "患者が装置に力を加えた"),
    "unmeasured.too_few_ways": ("fewer than two repetitions are complete", "完了した往復が2回未満"),
    "end_range": ("End-range time, s", "最終域保持時間(秒)"),
    "end_range_explained": (
        "End-range time: time before the end of the recorded motion, within the stated angle and with at least the stated torque between apparatus and "
        "shoulder.",
        "最終域保持時間：記録動作の終点の手前で、示した角度以内にあり、装置と肩の間のトルクが示した値以上の時間。",
    ),
    "dose": ("End-range time: prescribed and counted", "最終域保持時間：処方と計測"),
    "dose_counts": ("Counts", "計測条件"),
    "dose_threshold": ("last {band}°, at least {torque} Nm", "終点の手前{band}°以内、{torque} Nm以上"),
    "dose_session": ("This session, min", "このセッション(分)"),
    "dose_week": ("Its week, min", "この週(分)"),
    "dose_monday": ("Week from", "週の開始日"),
    "dose_minutes": ("Time, min", "時間(分)"),
    "dose_of": ("{counted} of {prescribed}", "{counted}／処方{prescribed}"),
    "dose_explained": (
        "The torque at the shoulder is an estimate, up to 0.3 Nm off. Times with little more or less than the stated torque are therefore uncertain.",
        "肩のトルクは推定値で、最大0.3 Nmの誤差がある。そのため、条件のトルクに近い値での時間は不確かである。",
    ),
    "healthy": ("Healthy, °", "参考値(°)"),
    "motions_caption": ("Range by the body's motions", "身体の動作別の範囲"),
    "nothing_compared": ("Nothing was played, so there is nothing to compare.", "再生されていないため、比較はない。"),
    "not_compared_yet": (
        "This playback has not ended, so nothing has been compared yet.",
        "この再生は終了していないため、まだ比較していない。",
    ),
    "reduced_only": (
        "The whole playback had a reduced range. It is not compared with the requested motion, and its angles are not listed.",
        "再生全体で可動範囲を狭めたため、要求した動作との比較はなく、到達した角度も示さない。",
    ),
    "unreadable": (
        "The samples of this playback cannot be read, so there are no curves.",
        "この再生のデータは読み取れないため、曲線を示せない。",
    ),
    "motion_with_number": ("{name} (motion {number})", "{name}（動作{number}）"),
    "motion.1": ("Scapular abduction / adduction", "肩甲骨 外転・内転"),
    "motion.2": ("Scapular upward / downward rotation", "肩甲骨 上方回旋・下方回旋"),
    "motion.3": ("Horizontal flexion / extension", "肩関節 水平屈曲・水平伸展"),
    "motion.4": ("Abduction / adduction", "肩関節 外転・内転"),
    "motion.5": ("Flexion / extension", "肩関節 屈曲・伸展"),
    "motion.6": ("External / internal rotation", "肩関節 外旋・内旋"),
    # The episode
    "episode_report": ("Episode report", "治療経過報告書"),
    "episode": ("Episode of care", "治療エピソード"),
    "onset": ("Onset", "発症日"),
    "opened": ("Opened", "開始日"),
    "closed": ("Closed", "終了日"),
    "goes_on": ("In progress", "継続中"),
    "stages": ("Stages", "病期"),
    "stage": ("Stage", "病期"),
    "since": ("Since", "開始日"),
    "stage.freezing": ("Freezing", "炎症期（freezing）"),
    "stage.frozen": ("Frozen", "拘縮期（frozen）"),
    "stage.thawing": ("Thawing", "回復期（thawing）"),
    "contraindications": ("Contraindications", "禁忌"),
    "noted": ("Recorded", "記録"),
    "permission": ("Treatment allowed by", "治療の許可"),
    "no_permission": ("No doctor has allowed the treatment", "医師の許可なし"),
    "resolved": ("No longer applies", "解消"),
    "contraindication.fracture": ("Fracture that has not united", "癒合していない骨折"),
    "contraindication.dislocation": ("Dislocation, unreduced or recent", "脱臼（未整復または最近のもの）"),
    "contraindication.infection": ("Infection or acute inflammation of joint or arm", "関節または腕の感染・急性炎症"),
    "contraindication.tumour": ("Tumour of shoulder or arm", "肩または腕の腫瘍"),
    "contraindication.thrombosis": ("Thrombosis of the arm", "腕の血栓症"),
    "contraindication.recent_repair": (
        "Recent repair of tendon, ligament or capsule",
        "腱・靱帯・関節包の最近の修復術",
    ),
    "contraindication.joint_replacement": ("Joint replacement of the shoulder", "人工肩関節"),
    "contraindication.nerve_injury": ("Nerve injury of the arm", "腕の神経損傷"),
    "contraindication.crps": ("Complex regional pain syndrome (CRPS)", "複合性局所疼痛症候群（CRPS）"),
    "contraindication.osteoporosis": ("Osteoporosis", "骨粗鬆症"),
    "contraindication.hypermobility": ("Hypermobility or instability", "過可動性または不安定性"),
    "contraindication.anticoagulation": ("Anticoagulation", "抗凝固療法"),
    "contraindication.pacemaker": ("Pacemaker or other active implant", "ペースメーカーなどの能動型埋込機器"),
    "contraindication.pregnancy": ("Pregnancy", "妊娠"),
    "contraindication.other": ("Other contraindication", "その他の禁忌"),
    "limits": ("Limits set by the doctor", "医師による制限"),
    "limits_by": ("Set by {name}", "指示医：{name}"),
    "from_deg": ("From, °", "下限(°)"),
    "up_to_deg": ("Up to, °", "上限(°)"),
    "max_speed": ("Highest speed: {speed} °/s", "最高速度：{speed}°/s"),
    "max_resistance_level": (
        f"Highest resistance level: {{level}} of {RESISTANCE_LEVELS}",
        f"抵抗許容レベル上限：{RESISTANCE_LEVELS}段階中{{level}}",
    ),
    "assessments": ("Assessments", "評価"),
    "no_assessments": ("There are no assessments yet.", "評価はまだ行われていない。"),
    "rom": ("Range of motion", "関節可動域"),
    "rom_caption": (
        "Degrees: first and newest values of the treated side, newest value of the other side, and reference of a healthy shoulder. "
        "Rotation with the arm flexed 90° is measured from the forearm pointing straight up.",
        "単位は°。治療側の初回と最新、反対側の最新、および健常肩の参考可動域。3rdの回旋は前腕が真上を向く肢位を0°とする。",
    ),
    "kind": ("Kind", "種別"),
    "kind.active": ("Active", "自動"),
    "kind.passive": ("Passive", "他動"),
    "baseline": ("First", "初回"),
    "newest": ("Newest", "最新"),
    "change": ("Change", "変化"),
    "other_side": ("Other side", "反対側"),
    "reference": ("Reference", "参考"),
    "pain_scores": ("Pain, 0 (none) to 10", "痛み（0：なし〜10）"),
    "pain.rest": ("At rest", "安静時"),
    "pain.active": ("On active movement", "自動運動時"),
    "pain.passive": ("On passive movement", "他動運動時"),
    "pain.average": ("Average over the last week", "この1週間の平均"),
    "questionnaire_scores": ("Questionnaires, total in points", "質問票（合計、点）"),
    "questionnaire": ("Questionnaire", "質問票"),
    "scale.lower": (
        "{title}, {lowest:g} to {highest:g} points, lower is better",
        "{title}（{lowest:g}〜{highest:g}点、低いほど良好）",
    ),
    "scale.higher": (
        "{title}, {lowest:g} to {highest:g} points, higher is better",
        "{title}（{lowest:g}〜{highest:g}点、高いほど良好）",
    ),
    "meaning": ("Meaning of the change", "変化の意味"),
    "meaning.none": ("change below the MCID", "MCID未満の変化"),
    "meaning.perhaps_better": (
        "improvement of at least the MCID, possibly measurement error",
        "MCID以上の改善（測定誤差の可能性あり）",
    ),
    "meaning.perhaps_worse": (
        "worsening of at least the MCID, possibly measurement error",
        "MCID以上の悪化（測定誤差の可能性あり）",
    ),
    "meaning.better": ("improvement beyond measurement error", "測定誤差を超える改善"),
    "meaning.worse": ("worsening beyond measurement error", "測定誤差を超える悪化"),
    "important_note": (
        "{title}: patients call a change of {least:g} points important (MCID; {source}).",
        "{title}：患者にとって意味のある最小の変化（MCID）は{least:g}点とされる（{source}）。",
    ),
    "important_range_note": (
        "{title}: patients call a change of {least:g} to {most:g} points important (MCID; {source}).",
        "{title}：患者にとって意味のある最小の変化（MCID）は{least:g}〜{most:g}点とされる（{source}）。",
    ),
    "detectable_note": (
        "A change of {detectable:g} points or less may be measurement error (SDC; {source}).",
        "{detectable:g}点以下の変化は測定誤差（SDC）の可能性がある（{source}）。",
    ),
    "t_score_note": (
        "{title} is a T-score: 50 points are the mean of the reference population, 10 points its standard deviation.",
        "{title}はTスコアである。50点が基準集団の平均、10点がその標準偏差である。",
    ),
    "trends": ("Trends", "推移"),
    "trends_rom": (
        "Range of motion of the treated side in degrees. Solid line: active; dashed line: passive; dotted line: newest value of "
        "the other side (passive, if measured); thin line: a healthy shoulder.",
        "治療側の関節可動域（°）。実線：自動、破線：他動、点線：反対側の最新値（他動があれば他動）、細線：健常肩の参考値。",
    ),
    "trends_angle": ("{name}, °", "{name}（°）"),
    "trends_pain": (
        "Pain before (solid) and after (dashed) a session, 0 to 10",
        "セッション前（実線）後（破線）の痛み（0〜10）",
    ),
    "sessions": ("Sessions", "セッション一覧"),
    "sessions_count_one": ("{count} session, {first}.", "{count}回（{first}）。"),
    "sessions_count": ("{count} sessions, {first} to {last}.", "{count}回（{first}〜{last}）。"),
    "planned_done": (
        "Planned repetitions that were completed: {done} of {planned}.",
        "予定した反復のうち最後まで再生：{planned}回中{done}回。",
    ),
    "repetitions_note": (
        "“Planned” and “Done” are numbers of repetitions. “Before” and “After” are pain scores, 0 to 10.",
        "「予定」「実施」は反復回数。「治療前」「治療後」は痛み（0〜10）。",
    ),
    "stops_count": ("Playbacks that were stopped: {count}.", "停止した再生：{count}回。"),
    "no_sessions": ("There have been no sessions yet.", "セッションはまだ行われていない。"),
    "in_sessions": ("Sessions", "セッション数"),
    "pain_change": ("Pain", "痛み"),
    "signed_column": ("Signed", "署名"),
    "answer.signed": ("Yes", "済"),
    "answer.unsigned": ("Draft", "未"),
    "closing_note": ("Closing note", "終了時の所見"),
}
"""English and Japanese text by key. The part of a key after the dot is a value of the record."""

STOP_REASONS_JA: Final = {
    "estop_pressed": "非常停止スイッチが押された。",
    "estop_unknown": "非常停止スイッチの状態が不明。",
    "contacts_disagree": "非常停止の2つの接点の状態が矛盾していた。",
    "bus_lost": "モータとの通信が途絶えた。",
    "other_adapter": "モータのアダプタの代わりに、別のRS-485アダプタが接続された。",
    "torque_found": "接続が戻る前から、モータ{motor}が腕を保持していた。",
    "drive_reset": "モータ{motor}の設定が失われた。",
    "drive_silent": "モータ{motor}が応答しない。",
    "drive_garbled": "モータ{motor}の応答が壊れている。",
    "drive_error": "モータ{motor}がハードウェア異常を報告した。",
    "drive_watchdog": "通信の途絶により、モータ{motor}が自ら停止した。",
    "torque_lost": "モータ{motor}が自らトルクを切った。",
    "torque_remains": "トルクを切ったはずのモータ{motor}にトルクが残っている。",
    "position_jump": "モータ{motor}がありえない位置を報告した。",
    "position_frozen": "モータ{motor}が動かない、またはエンコーダが停止した。",
    "overtorque": "モータ{motor}が定格トルクを超えた。",
    "overacceleration": "モータ{motor}の動きが急すぎた。",
    "position_limit": "モータ{motor}が可動範囲を外れた。",
    "overspeed": "モータ{motor}が速すぎた。",
    "following_error": "モータ{motor}が指令に追従できなかった。腕が何かに妨げられている。",
    "setpoint_step": "モータ{motor}への指令が飛びそうになった。",
    "setpoint_limit": "モータ{motor}への指令が限界を超えそうになった。",
    "setpoint_acceleration": "モータ{motor}への指令が急変しそうになった。",
    "setpoint_frozen": "制御プログラムが動作の計画を止めた。",
    "overrun": "制御用コンピュータの処理が間に合わなかった。",
    "service_silent": "制御用コンピュータと診療サービスとの接続が切れた。",
    "other_run": "診療サービスと制御用コンピュータの再生が一致しない。",
    "journal_fault": "測定値をディスクに書き込めなくなった。",
    "load_repeated": "モータ{motor}が同じ位置で2回抵抗を受けた。",
    "load_while_held": "腕の保持中に、モータ{motor}が抵抗を受けた。",
    "arm_too_heavy": "腕が動き出す前に、モータ{motor}のトルクが抵抗許容レベルに達した。腕が重すぎるか、患者が抵抗している。",
    "load_on_the_way": "開始位置への移動中または復帰中に、モータ{motor}が抵抗を受けた。",
    "operator_stop": "操作者が停止した。",
    "browser_lost": "操作していたブラウザとの接続が長く途絶えた。",
    "unexpected_error": "制御プログラム内部で異常が発生した。",
}
"""Japanese sentences of the fault table by code. The database stores only the English ones."""


class Phrases:
    """The phrases of one language and the formats of one time zone."""

    def __init__(self, language: Language, zone: str) -> None:
        """``zone``: IANA name of the time zone; empty: UTC."""
        self.language: Language = language
        self._column = LANGUAGES.index(language)
        self._zone = zone_of(zone)

    def text(self, key: str, /, **values: object) -> str:
        """Return the phrase of a key, filled with its parameters."""
        return join_units(PHRASES[key][self._column].format(**values))

    def named(self, kind: str, value: str | int) -> str:
        """Return the phrase of a value of the record, or the value itself if there is no phrase."""
        words = PHRASES.get(f"{kind}.{value}")
        return words[self._column] if words else str(value).replace("_", " ")

    def motion(self, number: int) -> str:
        """Return the name of a basic motion with its number."""
        return self.text("motion_with_number", name=self.named("motion", number), number=number)

    def measure(self, motion: str, position: str) -> str:
        """Return the name of a measure."""
        measure = rom.measure_of(motion, position)
        if measure is None:
            return f"{motion} {position}".replace("_", " ").strip()
        return measure.english if self.language == "en" else measure.japanese

    def stop(self, code: str, message: str, motor: int | None) -> str:
        """Return the cause of a stop. It is in English if the sentence needs a motor and none is stored.

        ``motor``: motor number from 1.
        """
        words = STOP_REASONS_JA.get(code, message)
        if self.language == "en" or (motor is None and "{motor}" in words):
            return message
        return words.format(motor=motor)

    def number(self, value: float | None, digits: int = 1, *, sign: bool = False) -> str:
        """Return a number with a typographic minus, or a dash if there is no number."""
        if value is None:
            return "–"
        shown = as_shown(value, digits)
        text = f"{shown:+.{digits}f}" if sign else f"{shown:.{digits}f}"
        return f"{0:.{digits}f}" if shown == 0 else text.replace("-", "−")

    def change(self, first: float, last: float, digits: int) -> str:
        """Return the change between two printed numbers with its sign. Called by the template ``parts.html``."""
        return self.number(change_as_shown(first, last, digits), digits, sign=True)

    def entered(self, value: float | None, *, sign: bool = False) -> str:
        """Return an entered number, or the difference of two, with all its decimals: a limit of 89.6° is not printed as 90°."""
        if value is None:
            return "–"
        # Adding 0 turns minus zero into zero.
        exact = round(value, _MOST_DECIMALS) + 0.0
        return (f"{exact:+g}" if sign and exact else f"{exact:g}").replace("-", "−")

    def span(self, ends_deg: tuple[float, float] | None, digits: int = 1) -> str:
        """Return the range from the lowest to the highest angle."""
        return (
            "–"
            if ends_deg is None
            else self.text("to", first=self.number(ends_deg[0], digits), last=self.number(ends_deg[1], digits))
        )

    def day(self, when: date | datetime) -> str:
        """Return a date, the same in texts and in narrow columns. In English the month is a word, so that it is not taken for the day."""
        local = self._local(when) if isinstance(when, datetime) else when
        if self.language == "ja":
            return f"{local.year}年{local.month}月{local.day}日"
        return join_units(f"{local.day} {_MONTHS[local.month - 1]} {local.year}")

    def clock(self, when: datetime) -> str:
        """Return a time of day."""
        return self._local(when).strftime("%H:%M")

    def clock_of(self, when: datetime, began: datetime) -> str:
        """Return a time of day, after its date if that is not the day of ``began``. Called by the template ``session.html``."""
        is_other_day = self._local(when).date() != self._local(began).date()
        return self.moment(when) if is_other_day else self.clock(when)

    def moment(self, when: datetime) -> str:
        """Return date and time."""
        return f"{self.day(when)} {self.clock(when)}"

    def zone(self, when: datetime) -> str:
        """Return the name that the clinic's time zone has at a given time."""
        return self._local(when).tzname() or ""

    def years(self, born: date, when: datetime) -> int:
        """Return a person's age in years."""
        today = self._local(when).date()
        return today.year - born.year - ((today.month, today.day) < (born.month, born.day))

    def _local(self, when: datetime) -> datetime:
        return when.astimezone(self._zone)
